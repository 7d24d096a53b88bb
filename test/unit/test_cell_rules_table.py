# SPDX-License-Identifier: Apache-2.0
"""What rules of cells make of every action: tiny maps, worked by hand."""

from cell_maps import GOAL, rules, steps
import numpy as np
import pytest
from table_planning import can_act

from comply_ros.world.cell_rules import Letter
from comply_ros.world.cell_rules_table import table_of
from comply_ros.world.grid import Grid, MapError
from comply_ros.world.mdp import World
from comply_ros.world.wind import Wind


def test_a_step_earns_the_reward_of_the_cell_that_it_leads_to():
    made = rules('..G')
    assert steps(made, 0, 0, 'right') == {(1, 0, -1.0): 1.0}
    assert steps(made, 1, 0, 'right') == {(2, 0, 10.0): 1.0}
    assert table_of(made).terminal.tolist() == [False, False, True]


def test_nobody_acts_in_an_obstacle_an_end_or_a_cell_that_leads_away_at_once():
    made = rules('.#PG', '.C..', '....',
                 legend={'P': Letter(-7.0, ends=True), 'C': Letter(to='start')})
    assert can_act(table_of(made)).tolist() == [
        True, True, True, True, True, False, True, True, True, False, False, False]


def test_an_obstacle_leaves_the_agent_where_it_is():
    assert steps(rules('.#G', '...'), 0, 1, 'right') == {(0, 1, -5.0): 1.0}


def test_no_move_leads_to_an_absent_edge():
    made = rules('..G')
    assert [action for action in ('left', 'right', 'down', 'up')
            if steps(made, 0, 0, action)] == ['right']


def test_one_bumps_into_an_edge():
    assert steps(rules('..G', edges_bump=True), 0, 0, 'down') == {(0, 0, -2.0): 1.0}


def test_a_pit_ends_the_episode_with_a_reward_of_its_own():
    table = table_of(rules('.PG', '...', legend={'P': Letter(-7.0, ends=True)}))
    assert table.terminal.tolist() == [False] * 4 + [True, True]
    assert steps(rules('.PG', '...', legend={'P': Letter(-7.0, ends=True)}), 0, 1, 'right') == {
        (1, 1, -7.0): 1.0}


def test_goals_have_rewards_of_their_own():
    made = rules('g.G', start=(1, 0), legend={'g': Letter(3.0, ends=True)})
    assert steps(made, 1, 0, 'left') == {(0, 0, 3.0): 1.0}
    assert steps(made, 1, 0, 'right') == {(2, 0, 10.0): 1.0}


def test_a_letter_gives_its_reward_while_the_episode_goes_on():
    made = rules('.m.G', legend={'m': Letter(-4.0)})
    assert steps(made, 0, 0, 'right') == {(1, 0, -4.0): 1.0}
    assert steps(made, 1, 0, 'right') == {(2, 0, -1.0): 1.0}


def test_a_cliff_leads_back_to_the_start():
    made = rules('...', '.CG', legend={'C': Letter(-100.0, to='start')})
    assert steps(made, 1, 1, 'down') == {(0, 0, -100.0): 1.0}


def test_a_cliff_leads_back_to_each_of_several_starts_equally_likely():
    made = rules('...', '.CG', starts=(0, 5), legend={'C': Letter(-100.0, to='start')})
    assert steps(made, 1, 1, 'down') == {(0, 0, -100.0): 0.5, (2, 1, -100.0): 0.5}
    assert steps(made, 1, 1, 'left') == {(0, 1, -1.0): 1.0}  # the rows behind are in their places


def test_a_portal_leads_to_its_cell_in_the_same_step():
    made = rules('....G', '..A..', legend={'A': Letter(2.0, to=(0, 0))})
    assert steps(made, 1, 0, 'right') == {(0, 0, 2.0): 1.0}


def test_a_portal_that_is_left_leads_to_its_cell_by_every_action():
    # Sutton and Barto, example 3.5: from A one comes to A', whatever one does.
    made = rules('.A', '..', continuing=True, edges_bump=True,
                 legend={'A': Letter(10.0, to=(1, 0), on_leaving=True)})
    assert steps(made, 0, 1, 'right') == {(1, 1, -1.0): 1.0}
    for action in ('left', 'right', 'down', 'up'):
        assert steps(made, 1, 1, action) == {(1, 0, 10.0): 1.0}


@pytest.mark.parametrize('cell, action', [('<', 'left'), ('>', 'right'), ('v', 'down'),
                                          ('^', 'up')])
def test_a_one_way_cell_is_left_by_its_move_only(cell, action):
    made = rules('..G', f'.{cell}.', '...')
    assert [each for each in ('left', 'right', 'down', 'up')
            if steps(made, 1, 1, each)] == [action]


def test_a_wall_is_between_two_cells():
    made = rules('..G', '...', walls=((1, 0, 1, 1), (1, 1, 2, 1)))
    assert steps(made, 0, 0, 'right') == {(0, 0, -3.0): 1.0}
    assert steps(made, 1, 0, 'left') == {(1, 0, -3.0): 1.0}
    assert steps(made, 1, 0, 'up') == {(1, 0, -3.0): 1.0}
    assert steps(made, 1, 1, 'down') == {(1, 1, -3.0): 1.0}
    assert steps(made, 0, 1, 'right') == {(1, 1, -1.0): 1.0}


def test_a_wall_may_be_drawn_from_either_end_and_on_the_border():
    made = rules('..G', '...', start=(1, 0), walls=((1, 2, 1, 0), (0, 0, 0, 2), (0, 0, 3, 0)))
    assert steps(made, 0, 1, 'right') == {(0, 1, -3.0): 1.0}
    assert steps(made, 0, 0, 'up') == {(0, 1, -1.0): 1.0}


def test_a_slip_becomes_any_other_action_of_the_cell():
    made = rules('...', '..G', intended=0.8)  # from the middle above: left, right, down
    assert steps(made, 1, 1, 'left') == {(0, 1, -1.0): 0.8, (2, 1, -1.0): 0.1, (1, 0, -1.0): 0.1}


def test_a_slip_becomes_one_of_the_two_moves_to_the_sides():
    made = rules('...', '..G', intended=0.8, slips='right_angles', edges_bump=True)
    assert steps(made, 1, 0, 'left') == {(0, 0, -1.0): 0.8, (1, 1, -1.0): 0.1, (1, 0, -2.0): 0.1}


def test_a_slip_towards_an_absent_edge_leaves_the_agent_where_it_is():
    made = rules('...', '..G', intended=0.8, slips='right_angles')
    assert steps(made, 1, 0, 'left') == {(0, 0, -1.0): 0.8, (1, 1, -1.0): 0.1, (1, 0, -2.0): 0.1}


def test_slips_have_chances_by_their_turn_counter_clockwise():
    made = rules('...', '...', '..G', slips={90: 0.1, -90: 0.2, 180: 0.05, 'stay': 0.25})
    assert steps(made, 1, 1, 'up') == {
        (1, 2, -1.0): 0.4, (0, 1, -1.0): 0.1, (2, 1, -1.0): 0.2, (1, 0, -1.0): 0.05,
        (1, 1, -1.0): 0.25}


def test_slips_can_leave_nothing_for_the_move_that_was_meant():
    made = rules('...', '...', '..G', slips={90: 0.5, -90: 0.5})
    assert steps(made, 1, 1, 'up') == {(0, 1, -1.0): 0.5, (2, 1, -1.0): 0.5}


def test_of_eight_moves_a_slip_can_turn_by_half_a_right_angle():
    made = rules('...', '...', '..G', moves=8, slips={45: 0.1, -45: 0.2})
    assert steps(made, 1, 1, 'up_right') == {
        (2, 2, -1.0): 0.7, (1, 2, -1.0): 0.1, (2, 1, -1.0): 0.2}


def test_slips_that_do_not_bump_become_only_moves_that_lead_elsewhere():
    made = rules('.#.', '..G', intended=0.8, slips_bump=False)  # up is an obstacle
    assert steps(made, 1, 0, 'left') == {(0, 0, -1.0): 0.8, (2, 0, 10.0): 0.2}


def test_equal_outcomes_are_one_outcome():
    made = rules('..', '.G', intended=0.8, slips='right_angles', edges_bump=True,
                 edge_reward=-1.0)
    assert steps(made, 0, 0, 'left') == {(0, 0, -1.0): 0.9, (0, 1, -1.0): 0.1}


def test_eight_moves_go_over_the_corners():
    made = rules('..', '.G', moves=8)
    assert steps(made, 0, 0, 'up_right') == {(1, 1, -1.0): 1.0}
    assert steps(made, 0, 1, 'down_right') == {(1, 0, 10.0): 1.0}
    assert steps(made, 0, 0, 'down_left') == {}


@pytest.mark.parametrize('rows', [('..', '.#'), ('#.', '..')])
def test_a_diagonal_move_goes_round_no_corner_of_an_obstacle(rows):
    made = rules(*(f'{row}.' for row in rows), '..G', moves=8)
    assert steps(made, 0, 1, 'up_right') == {(0, 1, -5.0): 1.0}


def test_a_diagonal_move_crosses_no_end_of_a_wall():
    made = rules('..', '.G', moves=8, walls=((1, 1, 2, 1),))
    assert steps(made, 0, 0, 'up_right') == {(0, 0, -3.0): 1.0}


def test_a_diagonal_move_goes_along_an_edge_that_one_bumps_into():
    assert steps(rules('..G', moves=8, edges_bump=True), 0, 0, 'up_right') == {(1, 0, -1.0): 1.0}


def test_standing_still_earns_the_reward_of_the_cell():
    made = rules('mG', stay=True, legend={'m': Letter(-4.0)}, intended=0.5)
    assert steps(made, 0, 0, 'stay') == {(0, 0, -4.0): 0.5, (1, 0, 10.0): 0.5}


def test_the_wind_of_the_column_that_is_left_is_added_to_a_move():
    made = rules('..G', '...', '...', wind=Wind(columns=(0, 1, 2)), edges_bump=True)
    assert steps(made, 0, 0, 'right') == {(1, 0, -1.0): 1.0}
    assert steps(made, 1, 0, 'left') == {(0, 1, -1.0): 1.0}
    assert steps(made, 1, 1, 'down') == {(1, 1, -1.0): 1.0}


def test_the_wind_of_a_row_blows_to_the_right_and_the_top_row_is_first():
    made = rules('....', '...G', wind=Wind(rows=(2, -1)), edges_bump=True)
    assert steps(made, 0, 1, 'down') == {(2, 0, -1.0): 1.0}
    assert steps(made, 1, 0, 'up') == {(0, 1, -1.0): 1.0}


def test_wind_ends_at_the_edge_at_obstacles_and_at_walls():
    made = rules('...', '#..', '...', '...', wind=Wind(columns=(2, 2, 2)), edges_bump=True,
                 continuing=True, walls=((1, 2, 2, 2),))
    assert steps(made, 2, 2, 'left') == {(1, 3, -1.0): 1.0}
    assert steps(made, 1, 0, 'left') == {(0, 1, -1.0): 1.0}
    assert steps(made, 2, 1, 'left') == {(1, 1, -1.0): 1.0}


def test_the_agent_that_the_wind_holds_earns_the_reward_of_what_it_bumps_into():
    made = rules('#.', '..', wind=Wind(columns=(1, 0)), edges_bump=True, continuing=True)
    assert steps(made, 0, 0, 'left') == {(0, 0, -2.0): 1.0}
    assert steps(made, 0, 0, 'up') == {(0, 0, -5.0): 1.0}


def test_wind_carries_over_cells_and_only_the_last_one_counts():
    made = rules('..', 'P.', '.G', start=(1, 2), legend={'P': Letter(-7.0, ends=True)},
                 wind=Wind(columns=(1, 0)), edges_bump=True)
    assert steps(made, 0, 0, 'up') == {(0, 2, -1.0): 1.0}
    assert steps(made, 0, 0, 'left') == {(0, 1, -7.0): 1.0}


def test_wind_blows_with_a_chance():
    made = rules('..', '.G', wind=Wind(columns=(1, 1), chance=0.25), edges_bump=True)
    assert steps(made, 0, 0, 'right') == {(1, 0, 10.0): 0.75, (1, 1, -1.0): 0.25}


def test_gusts_change_the_strength_of_wind_where_there_is_any():
    made = rules('..', '..', '..', '.G', wind=Wind(columns=(1, 0), gusts={-1: 0.25, 2: 0.5}),
                 edges_bump=True, edge_reward=-1.0)
    assert steps(made, 0, 0, 'right') == {(1, 0, 10.0): 0.25, (1, 1, -1.0): 0.25,
                                          (1, 3, -1.0): 0.5}
    assert steps(made, 1, 1, 'left') == {(0, 1, -1.0): 1.0}


def test_a_gust_of_0_is_the_wind_as_it_is_given():
    made = rules('..', '.G', wind=Wind(columns=(1, 0), gusts={0: 0.25, -1: 0.5}),
                 edges_bump=True)
    assert steps(made, 0, 0, 'right') == {(1, 0, 10.0): 0.5, (1, 1, -1.0): 0.5}


def test_a_map_without_a_step_limit_has_ten_times_its_states():
    assert table_of(rules('..G', '...')).step_limit == 60
    assert table_of(rules('..G', '...', step_limit=7)).step_limit == 7


def test_the_actions_are_named_in_their_order():
    assert table_of(rules('.G')).actions == ('left', 'right', 'down', 'up')
    assert table_of(rules('.G', moves=8, stay=True)).actions == (
        'left', 'right', 'down', 'up', 'down_left', 'down_right', 'up_left', 'up_right', 'stay')


def test_positions_are_the_centers_of_the_cells_in_metres():
    table = table_of(rules('.G', '..', cell_size=0.5, origin=(10.0, 20.0, np.pi / 2)))
    assert table.positions == pytest.approx(
        np.array([[9.75, 20.25], [9.75, 20.75], [9.25, 20.25], [9.25, 20.75]]))


def test_the_rules_of_a_grid_give_the_moves_of_a_grid():
    rows = ('..#.G', '.#...', '.....')
    grid = Grid(rows, (0,), -1.0, -5.0, 10.0, 0.8, 50)
    world, made = World(grid), rules(*rows, intended=0.8)
    for s in np.flatnonzero(world.free):
        for a, action in enumerate(('left', 'right', 'down', 'up')):
            wanted = {}
            others = [b for b in range(4) if b != a and world.slips[s, b]]
            for b in [a, *others] if world.available[s, a] else []:
                s2 = int(world.successor[s, b])
                key = s2 % 5, s2 // 5, float(world.reward[s, b])
                chance = 0.8 if b == a else 0.2 / len(others)
                wanted[key] = round(wanted.get(key, 0.0) + chance, 12)
            assert steps(made, s % 5, s // 5, action) == pytest.approx(wanted)


def test_the_goal_must_be_reachable_also_through_one_way_cells():
    with pytest.raises(MapError) as error:
        table_of(rules('.<G'))
    assert str(error.value) == ('the goal must be reachable from every start, but no way leads '
                                'there from (0, 0)')
    table_of(rules('.>G'))


def test_a_pit_is_no_goal_but_an_end():
    pit = {'P': Letter(0.0, ends=True)}
    with pytest.raises(MapError, match='the goal must be reachable'):
        table_of(rules('P.#G', start=(1, 0), legend=pit))
    with pytest.raises(MapError, match='an end must be reachable'):
        table_of(rules('.#P', legend=pit))
    table_of(rules('.P', legend=pit))


def test_a_cliff_before_a_start_that_leads_to_no_goal_is_found():
    with pytest.raises(MapError, match=r'no way leads there from \(0, 0\)'):
        table_of(rules('.C.G', legend={'C': Letter(-100.0, to='start')}))


def test_too_many_outcomes_are_rejected():
    width = 5000
    with pytest.raises(MapError) as error:
        table_of(rules('.' * (width // 2 - 1) + 'G', 'C' * (width // 2),
                       '.' * (width // 2), starts=tuple(range(width // 2)) * 3,
                       legend={'C': Letter(to='start'), 'G': GOAL}))
    assert str(error.value) == (
        'a map may have at most 20000000 outcomes of its actions in all states, got more: 7500 '
        'starts behind each step back to them')
