# SPDX-License-Identifier: Apache-2.0
"""Pictures of maps that are no grid: with pits, portals, diagonal moves, standing still."""

from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
import numpy as np
import pytest
from tiny_tables import hall, machine

from comply_ros.plots.map_plot import draw_map, has_cells, MOST_CELLS
from comply_ros.plots.state_plot import state_trust_figure
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

POND = """
moves: 8
stay: true
edges: bump
rewards: {step: -1, goal: 10}
legend:
  P: {reward: -9, ends: true}
rows:
  - '#.G'
  - 'S.P'
"""


@pytest.fixture(scope='module')
def pond(tmp_path_factory):
    """Return a map with a pit: states 0 to 2 are its lower row, 3 to 5 the upper one."""
    path = tmp_path_factory.mktemp('maps') / 'pond.yaml'
    path.write_text(POND, encoding='utf-8')
    return World(read_map(str(path), 'published'))


def drawn(world, states, names):
    """Return axes in which actions are drawn in some states, all in red."""
    axes = Figure().add_subplot()
    colors = np.tile([1.0, 0.0, 0.0, 1.0], (len(states), 1))
    draw_map(axes, world, world.positions, np.array(states, np.intp), colors, names)
    return axes


def of_kind(axes, kind):
    """Return what is drawn in axes of a kind."""
    return [each for each in axes.collections if type(each) is kind]


def test_a_direction_is_an_arrow_of_the_same_length_whether_diagonal_or_not(pond):
    arrows, = of_kind(drawn(pond, [0, 1], ['right', 'up_right']), Quiver)
    assert arrows.XY.tolist() == [[0.5, 0.5], [1.5, 0.5]]
    assert arrows.U.tolist() == pytest.approx([0.72, 0.72 / 2 ** 0.5])
    assert arrows.V.tolist() == pytest.approx([0.0, 0.72 / 2 ** 0.5])


def test_standing_still_is_its_sign_in_the_cell(pond):
    axes = drawn(pond, [0, 4], ['right', 'stay'])
    text, = axes.texts
    assert (text.get_text(), text.get_position()) == ('\u2022', (1.5, 1.5))


def test_a_goal_is_a_star_a_pit_a_cross_and_an_obstacle_a_square(pond):
    axes = drawn(pond, [], [])
    goal, pit, *_ = of_kind(axes, PathCollection)
    assert goal.get_offsets().tolist() == [[2.5, 1.5]]
    assert pit.get_offsets().tolist() == [[2.5, 0.5]]
    assert len(goal.get_paths()[0].vertices) != len(pit.get_paths()[0].vertices)
    walls, = of_kind(axes, PolyCollection)
    assert walls.get_paths()[0].vertices[:4].tolist() == [[0, 1], [1, 1], [1, 2], [0, 2]]


def test_a_world_of_moves_on_a_map_has_cells_and_others_have_not(pond):
    places = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    assert has_cells(pond)
    assert not has_cells(World(machine(positions=places)))  # run, stop and repair: no moves
    assert not has_cells(World(machine()))
    assert not has_cells(World(hall(4, 2)))


def test_a_map_whose_arrows_would_be_too_small_is_drawn_in_points(tmp_path):
    path = tmp_path / 'long.yaml'
    path.write_text('legend: {P: {ends: true}}\nrewards: {step: -1, goal: 1}\n'
                    f'rows: [S{"." * MOST_CELLS}G]\n', encoding='utf-8')
    assert not has_cells(World(read_map(str(path), 'published')))


def test_the_trust_map_of_a_map_with_a_pit_has_an_arrow_in_each_advised_cell(pond):
    n = pond.n_states
    advice = np.where(pond.free, pond.action_names.index('right'), -1).astype(np.int8)
    figure = state_trust_figure(pond, 'title', advice, np.full(n, 0.5), np.ones(n, bool))
    arrows, = of_kind(figure.axes[0], Quiver)
    assert arrows.XY.tolist() == [[0.5, 0.5], [1.5, 0.5], [1.5, 1.5]]
    assert figure.axes[0].get_xlabel() == 'x (m)'
