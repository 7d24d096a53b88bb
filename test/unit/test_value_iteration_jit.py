# SPDX-License-Identifier: Apache-2.0
"""Value iteration in machine code has the bits of value iteration in numpy."""

from dataclasses import replace
import subprocess
import sys

import numpy as np
import pytest
from tiny_worlds import corridor, grid, room

from comply_ros.storage.map_files import read_map
from comply_ros.world import planning, value_iteration_jit
from comply_ros.world.mdp import World
from comply_ros.world.planning import (
    action_values,
    greedy,
    optimal_values,
    PlanningError,
    TOLERANCE,
    value_iteration,
)
from comply_ros.world.value_iteration_jit import (
    best_value,
    compiled_value_iteration,
    plain_runs,
    update,
)


def random_grid(seed):
    """Return a grid of free cells, obstacles and goals by chance, larger than a row of plain."""
    generator = np.random.Generator(np.random.PCG64(seed))
    height, width = generator.integers(1, 30, size=2)
    cells = generator.choice(list('...........#.G'), size=(height, width))
    cells[generator.integers(height), generator.integers(width)] = 'G'
    rows = [''.join(row) for row in cells]
    free = [s for s, cell in enumerate(''.join(reversed(rows))) if cell == '.']
    beside = [s for s in free if 'G' in neighbours(''.join(reversed(rows)), s, width)]
    return grid(*rows, starts=tuple(beside[:1]), intended=float(generator.choice([0.3, 0.9, 1.0])),
                step=-float(generator.random()) - 0.01) if beside else random_grid(seed + 1000)


def neighbours(cells, s, width):
    """Return the cells beside s."""
    places = [s - width, s + width, *([s - 1] if s % width else []),
              *([s + 1] if s % width < width - 1 else [])]
    return [cells[place] for place in places if 0 <= place < len(cells)]


def in_numpy(world, discount=1.0):
    """Return the values of the first sweep that settles, swept in numpy."""
    return next(values for values, change in value_iteration(world, discount)
                if change < TOLERANCE)


@pytest.mark.parametrize('name', ['bar_grid', 'free_grid', 'maze', 'maze_as_run'])
def test_the_maps_of_the_package_have_the_same_bits(name):
    world = World(read_map(name, 'published'))
    values, change = compiled_value_iteration(world, 1.0, TOLERANCE, 10_000)
    assert values.tobytes() == in_numpy(world).tobytes()
    assert change < TOLERANCE


@pytest.mark.parametrize('seed', range(40))
def test_random_maps_have_the_same_bits(seed):
    rows = random_grid(seed)
    world, discount = World(replace(rows, slips_bump=bool(seed % 2))), (1.0, 0.9)[seed % 3 == 0]
    values, _ = compiled_value_iteration(world, discount, TOLERANCE, 10_000)
    assert values.tobytes() == in_numpy(world, discount).tobytes()


@pytest.mark.parametrize('sweeps', [1, 2, 7, 40])
def test_every_sweep_has_the_bits_of_numpy(sweeps):  # also before the values settle
    world = World(read_map('bar_grid', 'report'))
    iteration = value_iteration(world)
    for _ in range(sweeps):
        values, change = next(iteration)
    assert compiled_value_iteration(world, 1.0, TOLERANCE, sweeps)[0].tobytes() == values.tobytes()
    assert compiled_value_iteration(world, 1.0, TOLERANCE, sweeps)[1] == change


def test_settled_values_are_a_fixed_point_within_the_tolerance():
    world = World(read_map('maze', 'report'))
    values, _ = compiled_value_iteration(world, 1.0, TOLERANCE, 10_000)
    again = np.where(world.free, action_values(world, values).max(axis=1), 0.0)
    assert np.abs(again - values).max() < TOLERANCE


def test_large_worlds_are_swept_in_machine_code(monkeypatch):
    world, swept = World(read_map('free_grid', 'report')), []

    def record(*arguments):
        swept.append(len(world.free))
        return compiled_value_iteration(*arguments)
    monkeypatch.setattr(planning, 'compiled_value_iteration', record)
    small = optimal_values(world)
    assert swept == []
    monkeypatch.setattr(planning, 'LARGE', 121)
    large = optimal_values(world)
    assert swept == [121]
    assert large.tobytes() == small.tobytes()
    assert (greedy(action_values(world, large), world.free)
            == planning.optimal_policy(world)).all()


@pytest.mark.parametrize('many', [1, 10_000])
def test_values_that_do_not_settle_are_an_error_that_says_so(monkeypatch, many):
    monkeypatch.setattr(planning, 'LARGE', many)
    monkeypatch.setattr(planning, 'MOST_SWEEPS', 2)
    with pytest.raises(PlanningError) as error:
        optimal_values(corridor())
    assert str(error.value) == ('value iteration must settle within 2 sweeps, '
                                'but a value still changes by 7.8')


def test_without_numba_large_worlds_are_swept_in_numpy():
    code = ('import sys; sys.modules["numba"] = None; sys.path.insert(0, "test/support");'
            'from comply_ros.world import planning; from tiny_worlds import corridor;'
            'planning.LARGE = 1; planning.compiled_value_iteration = None;'
            'print(planning.optimal_values(corridor()).round(6).tolist())')
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True,
                          cwd=value_iteration_jit.__file__.rpartition('comply_ros/world')[0])
    assert done.stdout == '[8.5, 9.5, 0.0]\n'


def test_plain_states_stand_in_runs_within_a_row():
    # The goal is in the upper right corner; of 4 x 4 cells the inner four have all moves, and
    # one beside an obstacle bumps: it is not plain.
    assert plain_runs(World(grid('...G', '....', '....', '....'))).reshape(4, 4).tolist() == [
        [0, 1, 2, 3], [4, 7, 7, 7], [8, 11, 11, 11], [12, 13, 14, 15]]
    assert plain_runs(World(grid('...G', '#...', '....', '....'))).reshape(4, 4)[2].tolist() == [
        8, 9, 11, 11]


def test_the_best_value_of_a_state(as_run):  # as in test_planning.py: 0.8 * 10 + 0.2 * (-1 + 5)
    world = corridor()
    best = as_run(best_value)(1, np.array([5.0, 7.0, 0.0]), 1.0, 0.8, world.successor,
                              world.reward, world.slips)
    assert best == pytest.approx(8.8)


def test_an_update_in_the_middle_of_a_room(as_run):
    # Best is up: 0.8 * (-1 + 3) + 0.2 * ((-1 + 2) + (-1 + 0) + (-1 + 0)) / 3 = 1.6 - 0.2 / 3.
    world, other = room(), np.full(9, 7.0)
    values = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 3.0, 0.0])
    as_run(update)(4, 5, values, other, 1.0, 0.8, 3, world.successor, world.reward, world.slips,
                   world.free, plain_runs(world))
    assert other[4] == pytest.approx(0.8 * 2 + 0.2 * -1 / 3)
    assert (np.delete(other, 4) == 7.0).all()
