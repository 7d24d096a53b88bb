# SPDX-License-Identifier: Apache-2.0
"""Which world an environment of Gymnasium is. Skipped where Gymnasium is not installed."""

import pytest

from comply_ros.storage.gymnasium_world import (
    EnvironmentName,
    EnvironmentWorld,
    moves_of_map,
    read_bins,
    read_environment_name,
    read_limits,
)
from comply_ros.storage.map_files import read_map, read_world
from comply_ros.world.grid import MapError
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table

gymnasium = pytest.importorskip('gymnasium')
DISCRETE = gymnasium.spaces.Discrete(3), gymnasium.spaces.Discrete(2)
LIMITS = 'limits=-2.4,2.4;-3,3;-0.2,0.2;-3,3'


def world_of(name, **options):
    """Return the world of an environment."""
    return EnvironmentWorld(EnvironmentName(name, **options)).source


def test_a_world_without_a_table_has_no_model():
    assert world_of('MountainCar-v0', bins=(40,)) == Spaces(1600, ('0', '1', '2'), 200)


def test_a_table_is_used_unless_it_shall_not_be():
    assert type(world_of('Taxi-v4')) is Table
    assert world_of('Taxi-v4', use_table=False) == Spaces(500, tuple('012345'), 200)


def test_our_own_maps_keep_their_step_limit_as_environments():
    assert world_of('comply_ros.environments:comply_ros/BarGrid-v0').step_limit == read_map(
        'bar_grid', 'published').step_limit


@pytest.mark.parametrize('name', ['MountainCarContinuous-v0', 'Pendulum-v1'])
def test_actions_that_are_not_discrete_are_rejected(name):
    with pytest.raises(MapError, match=f"environment '{name}': the action space must be Discrete, "
                       r'got Box\('):
        world_of(name)


def test_a_table_that_is_no_map_is_not_used_or_rejected(monkeypatch):
    class Uneven(gymnasium.Env):
        observation_space, action_space = DISCRETE
        initial_state_distrib, P = [0.75, 0.25, 0.0], {s: {0: [], 1: []} for s in range(3)}
    monkeypatch.setitem(gymnasium.registry, 'Uneven-v0', gymnasium.envs.registration.EnvSpec(
        'Uneven-v0', Uneven))
    name = EnvironmentName('Uneven-v0')
    assert EnvironmentWorld(name).source == Spaces(3, ('0', '1'), 30)
    with pytest.raises(MapError, match='; use_table=false makes it a world without a model'):
        EnvironmentWorld(name, requires_table=True)


def test_bins_limits_and_table_are_keys_of_a_name_and_others_are_arguments():
    name = read_environment_name('A-v0', {'bins': '3,4', 'limits': '0,1;-2,2', 'use_table': False,
                                          'is_wet': True})
    assert name == ('A-v0', {'is_wet': True}, (3, 4), ((0.0, 1.0), (-2.0, 2.0)), False)
    assert read_environment_name('A-v0', {}) == ('A-v0', {}, (20,), (), True)


@pytest.mark.parametrize('name, states', [
    ('gym:MountainCar-v0?bins=40', 1600), ('gym:MountainCar-v0?bins=4,5', 20),
    ('gym:MountainCar-v0?bins=[4,5]', 20), (f'gym:CartPole-v1?bins=3&{LIMITS}', 81),
    ('gym:Blackjack-v1', 704), ('gym:FrozenLake-v1?use_table=false&map_name=8x8', 64)])
def test_an_environment_without_a_table_is_a_world_by_its_name(name, states):
    world = read_world(name, 'published')
    assert type(world) is Spaces and world.n_states == states


def test_a_map_must_have_a_table():
    with pytest.raises(MapError, match=r"map 'gym:MountainCar-v0': this environment has no table "
                       r'of its transitions \(P\), so only train, lesson, sweep and the node '
                       'gym_world take it'):
        read_map('gym:MountainCar-v0', 'published')


@pytest.mark.parametrize('name, message', [
    ('gym:CartPole-v1', "environment 'CartPole-v1': the observation space needs finite limits "
     'with the lower one first, got -inf to inf in dimension 1: give limits'),
    ('gym:MountainCar-v0?bins=4,5,6', "environment 'MountainCar-v0': bins must have one element "
     'for each of the 2 dimensions of the observation space, got 3'),
    ('gym:MountainCar-v0?bins=many', 'bins must be a whole number, or one for each dimension, '
     "such as 40 or 40,40, got 'many'"),
    ('gym:MountainCar-v0?limits=1,2,3', "limits must be LOW,HIGH of each dimension, with ';' "
     "between two, such as '-1.2,0.6; -0.07,0.07', got '1,2,3'"),
    ('gym:Taxi-v4?use_table=maybe', "use_table must be true or false, got 'maybe'")])
def test_a_name_that_is_no_world_says_why(name, message):
    with pytest.raises(MapError) as error:
        read_world(name, 'published')
    assert str(error.value) == f'map {name!r}: {message}'


@pytest.mark.parametrize('value, bins', [(40, (40,)), ('40, 30', (40, 30)), ([4, 5], (4, 5))])
def test_bins_are_whole_numbers(value, bins):
    assert read_bins(value) == bins


@pytest.mark.parametrize('value', [4.5, '4.5,2', True, [], None, [[4]], 'a'])
def test_other_bins_are_rejected(value):
    with pytest.raises(MapError, match='bins must be a whole number, or one for each dimension'):
        read_bins(value)


def test_limits_are_pairs():
    assert read_limits('-1.2,0.6; -0.07,0.07') == ((-1.2, 0.6), (-0.07, 0.07))
    assert read_limits(' ') == ()


def test_moves_are_those_of_the_environment_of_a_map():
    moves, again = (moves_of_map('gym:MountainCar-v0?bins=40', seed) for seed in (3, 3))
    assert moves.start(1) == again.start(1)
    assert moves.move(0, 0, 2) == again.move(0, 0, 2)
    with pytest.raises(MapError, match="or a map gym:NAME, got 'maze'"):
        moves_of_map('maze', 0)


class Drawn(gymnasium.Env):
    """An environment that can be drawn."""

    metadata = {'render_modes': ['rgb_array'], 'render_fps': 4}
    observation_space, action_space = DISCRETE

    def __init__(self, render_mode=None):
        self.render_mode = render_mode


@pytest.mark.filterwarnings('ignore:.*latest versioned environment')
def test_pictures_are_asked_for_where_an_environment_has_them(monkeypatch):
    monkeypatch.setitem(gymnasium.registry, 'Drawn-v0', gymnasium.envs.registration.EnvSpec(
        'Drawn-v0', Drawn))
    drawn = EnvironmentName('Drawn-v0')
    for name in drawn, EnvironmentName('Drawn'):  # the newest version
        assert EnvironmentWorld(name, gives_pictures=True).moves(0).gives_pictures
    assert not EnvironmentWorld(drawn).moves(0).gives_pictures
    own = EnvironmentName('comply_ros.environments:comply_ros/BarGrid-v0')
    assert not EnvironmentWorld(own, gives_pictures=True).moves(0).gives_pictures
