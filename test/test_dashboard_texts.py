# SPDX-License-Identifier: Apache-2.0
"""What the page says of a lesson."""

import pytest
from tiny_worlds import grid

from comply_ros.dashboard.control_panel import nearest_speed, speed_words, SPEEDS
from comply_ros.dashboard.curve_panel import level_words, progress_words
from comply_ros.dashboard.dashboard_node import Status, View
from comply_ros.dashboard.header_bar import alarm, state_words
from comply_ros.dashboard.health_panel import health_words
from comply_ros.dashboard.mentor_panel import trust_words
from comply_ros.dashboard.run_view import Heard, Sight
from comply_ros.protocol.messages import describe_world, Progress
from comply_ros.world.mdp import World

GRID = grid('..G')
SAID = Progress(1, 3, 40, 15, 100, 2.345, 0.5, 1.0, False)


def view(*, heard=Heard(), words='runs', level=0, **ages):
    """Return a view of nodes that were heard so many seconds ago."""
    health = {name: Status(level, words, {'ignored: a': '2', 'ignored: b': '1'}, 'process 1',
                           100.0 - age) for name, age in ages.items()}
    return View(Sight(describe_world(GRID, 'small', run=1), World(GRID), heard), health=health, at=100.0)


def test_nobody_is_missed_while_all_speak():
    seen = view(grid_world=0.5, mentor=0.5, learner=0.5)
    assert alarm(seen) == '' and state_words(seen) == 'runs'


def test_who_fell_silent_and_who_never_spoke_are_named():
    seen = view(grid_world=0.5, learner=7.2)
    assert alarm(seen) == (
        'The mentor is not heard: start it with scripts/run mentor. '
        'The learner has been silent for 7 s: start it with scripts/run learner.')
    assert state_words(seen) == 'stands still'
    assert health_words(seen, 'learner') == ('is lost: silent for 7 s', 'ill')
    assert health_words(seen, 'mentor') == ('is not heard', '')


def test_at_first_nobody_is_missed():
    assert alarm(View(at=102.0, began=100.0)) == ''
    assert alarm(View(at=104.0, began=100.0)).count('is not heard') == 3


@pytest.mark.parametrize('level, kind', [(0, 'well'), (1, 'waiting'), (2, 'ill')])
def test_a_node_is_shown_in_its_own_words_with_what_it_counted(level, kind):
    seen = view(grid_world=0.5, words='waits for a learner', level=level)
    assert health_words(seen, 'grid_world') == ('waits for a learner, ignored 3', kind)


def test_a_world_that_says_it_is_paused_is_shown_so():
    assert state_words(view(grid_world=0.5, learner=0.5, words='is paused')) == 'paused'
    finished = Heard(progress=SAID._replace(finished=True))
    assert state_words(view(grid_world=0.5, learner=0.5, heard=finished)) == 'has finished'
    assert state_words(View()) == 'no world yet'


def test_progress_and_levels_are_said_in_numbers():
    assert progress_words(Heard(progress=SAID)) == (
        'iteration 3 of 40: mean return 2.35, trust 0.50')
    alone = SAID._replace(iterations=0, confidence=float('nan'), mean_return=-1.0)
    assert progress_words(Heard(progress=alone)) == 'iteration 3: mean return -1.00'
    assert level_words(5.84, None) == 'The best policy earns 5.84 an episode'
    assert level_words(None, None) == ''


def test_trust_in_the_person_is_that_of_the_last_iteration():
    assert trust_words(view(heard=Heard(progress=SAID))) == 'trust in you 0.50'
    assert trust_words(view()) == 'no trust yet: no decision had advice'


def test_every_speed_has_its_place_and_its_words():
    assert [nearest_speed(speed) for speed in SPEEDS] == list(range(len(SPEEDS)))
    assert SPEEDS[nearest_speed(300.0)] == 200.0
    assert [speed_words(rate) for rate in (1.0, 0.5, 0.0)] == [
        '1 step a second', '0.5 steps a second', 'as fast as it goes']
