# SPDX-License-Identifier: Apache-2.0
"""The texts of the page."""

import pytest
from tiny_tables import frozen_lake, machine
from tiny_worlds import grid

from comply_ros.dashboard.control_panel import (
    later_rates,
    nearest_speed,
    speed_text,
    SPEEDS,
)
from comply_ros.dashboard.curve_panel import progress_text, reference_text
from comply_ros.dashboard.dashboard_node import NodeStatus, PageState, RunSnapshot
from comply_ros.dashboard.header_bar import alarm_text, run_state_text
from comply_ros.dashboard.health_panel import health_text
from comply_ros.dashboard.mentor_panel import steering_actions, trust_text
from comply_ros.nodes.diagnostics import ERROR, OK, WARN
from comply_ros.protocol.messages import Progress
from comply_ros.protocol.run_reports import RunReports
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.mdp import World

GRID = grid('..G')
PROGRESS = Progress(1, 3, 40, 15, 100, 2.345, 0.5, 1.0, False)


def reports_of(progress=None):
    """Return the reports of a run, with a `Progress` if there is one."""
    reports = RunReports()
    reports.add('world', describe_world(GRID, 'small', run=1))
    reports.progress = progress
    return reports


def page_state(*, progress=None, message='runs', level=OK, **ages):
    """Return a state of the page in which nodes sent their status so many seconds ago."""
    nodes = {name: NodeStatus(level, message, {'ignored: a': '2', 'ignored: b': '1'}, 'process 1',
                              100.0 - age) for name, age in ages.items()}
    run = RunSnapshot(World(GRID), reports_of(progress))
    return PageState(run, nodes=nodes, time=100.0)


def test_there_is_no_alarm_while_all_nodes_send_their_status():
    state = page_state(grid_world=0.5, mentor=0.5, learner=0.5)
    assert alarm_text(state) == '' and run_state_text(state) == 'running'


def test_nodes_that_are_lost_and_nodes_that_never_started_are_named():
    state = page_state(grid_world=0.5, learner=7.2)
    assert alarm_text(state) == (
        'No mentor publishes on /recommendation: start one with scripts/run mentor. '
        'The learner has sent no status for 7 s: start it with scripts/run learner.')
    assert run_state_text(state) == 'stopped'
    assert health_text(state, 'learner') == ('lost: no status for 7 s', 'ill')
    assert health_text(state, 'mentor') == (
        'no mentor publishes on /recommendation', '')


def test_the_alarm_gives_the_nodes_some_seconds_after_the_start():
    assert alarm_text(PageState(time=102.0, start_time=100.0)) == ''
    assert alarm_text(PageState(time=104.0, start_time=100.0)).count('No ') == 3


@pytest.mark.parametrize('level, kind', [(OK, 'well'), (WARN, 'waiting'), (ERROR, 'ill')])
def test_a_node_is_shown_with_its_message_and_its_counts(level, kind):
    state = page_state(grid_world=0.5, message='waits for a learner', level=level)
    assert health_text(state, 'grid_world') == ('waits for a learner, ignored 3', kind)


def test_the_state_of_the_run_is_shown():
    assert run_state_text(page_state(grid_world=0.5, learner=0.5, message='is paused')) == 'paused'
    finished = PROGRESS._replace(finished=True)
    assert run_state_text(page_state(grid_world=0.5, learner=0.5, progress=finished)) == 'finished'
    assert run_state_text(PageState()) == 'no world yet'


def test_progress_and_expected_returns_are_shown_in_numbers():
    assert progress_text(reports_of(PROGRESS)) == (
        'iteration 3 of 40: mean return 2.35, trust 0.50')
    alone = PROGRESS._replace(iterations=0, confidence=float('nan'), mean_return=-1.0)
    assert progress_text(reports_of(alone)) == 'iteration 3: mean return -1.00'
    assert reference_text(5.84, None) == 'expected return: optimal policy 5.84'
    assert reference_text(None, None) == ''


def test_trust_in_the_human_mentor_is_that_of_the_last_iteration():
    assert trust_text(page_state(progress=PROGRESS)) == 'trust in you 0.50'
    assert trust_text(page_state()) == 'no trust yet: no decision had advice'


def test_trust_in_the_human_mentor_beside_others_is_that_in_its_own_name():
    state = page_state(progress=PROGRESS)
    for name, confidence in (('anna', 0.25), ('eva', 0.75)):
        state.run.reports.add('progress', PROGRESS._replace(mentor=name, confidence=confidence))
    assert trust_text(state, 'eva') == 'trust in you 0.75'
    assert trust_text(state, 'max') == 'no trust yet: no decision had advice'


@pytest.mark.parametrize('names, shared, alarm', [
    (('',), True, '3 mentors speak: the learner uses the advice of all, and the same options need '
     'not give the same bits. End all but one.'),
    (('anna', 'bob', ''), False, ''), (('anna', 'bob', 'carl'), True, ''),
    (('anna', 'bob'), False, ''),  # one of three has just ended
    (('anna', 'bob'), True, '3 mentors share 2 names: the learner cannot tell those of one name '
     'apart. Give each a name of its own.')])
def test_mentors_with_a_name_each_are_no_cause_for_an_alarm(names, shared, alarm):
    state = page_state(grid_world=0.5, mentor=0.5, learner=0.5)
    state = state._replace(mentor_names=names, is_name_shared=shared)
    assert alarm_text(state, mentors=3) == alarm


def test_every_speed_has_its_place_on_the_slider_and_its_text():
    assert [nearest_speed(speed) for speed in SPEEDS] == list(range(len(SPEEDS)))
    assert SPEEDS[nearest_speed(300.0)] == 200.0
    assert [speed_text(rate) for rate in (1.0, 0.5, 0.0)] == [
        '1 step per second', '0.5 steps per second', 'as fast as possible']


def test_the_slider_waits_for_the_last_rate_that_was_set_and_follows_those_of_others():
    assert later_rates([500.0, 1000.0, 0.0], 500.0) == [1000.0, 0.0]
    assert later_rates([500.0, 1000.0, 0.0], 0.0) == []
    assert later_rates([500.0, 1000.0], 7.0) == [] == later_rates([], 7.0)


def test_an_arrow_key_advises_the_action_with_its_name_wherever_a_world_has_that():
    assert steering_actions(World(frozen_lake())) == {  # left, down, right, up
        'ArrowLeft': 0, 'ArrowRight': 2, 'ArrowDown': 1, 'ArrowUp': 3}
    assert steering_actions(World(machine())) == {}
