# SPDX-License-Identifier: Apache-2.0
"""What `check` shows fits the terminal, and a failure is in a bag as it was on the wire."""

from pathlib import Path
import xml.etree.ElementTree as ElementTree

import pytest
from tiny_worlds import grid

from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.message_decoder import DecodedMessages
from comply_ros.nodes.check_report import (
    FailureBag,
    message_text,
    verdict_lines,
    write_bag,
    write_junit,
)
from comply_ros.nodes.topics import reader, STATE
from comply_ros.protocol.messages import Action, StateReward
from comply_ros.protocol.rule_report import FAIL, NOT_REACHED, PASS, Received, Verdict
from comply_ros.protocol.world_description import describe_world, is_same_world

WORLD = describe_world(grid('.....G', '......', starts=(0, 1, 2, 3, 6)), 'room', 7)
OBSERVATION = StateReward(7, 1, 0, 3, 0.0, False, False)
ACTION = Action(7, 1, 0, 2, False, 0.25, 33)
FAILED = Verdict('L13', FAIL, 'no action for an observation that skips a step, which is long',
                 'an action', (WORLD, OBSERVATION, ACTION))


def test_a_path_that_is_longer_than_a_line_stays_whole():
    path = Path('/a-folder-with-a-name/' * 5 + 'M6')
    lines = list(verdict_lines(FAILED, 'no step is skipped', 60, FailureBag(path, 3)))
    assert any(str(path) in line for line in lines)


@pytest.mark.parametrize('width', [60, 80])
def test_no_line_is_wider_than_the_terminal(width):
    bag = FailureBag(Path('runs/check-2026-11-27-10-23-49/L13'), 12)
    lines = list(verdict_lines(FAILED, 'no step is skipped', width, bag))
    assert max(map(len, lines)) <= width
    assert lines[0] == 'FAIL        L13  no step is skipped (SHOULD)'
    assert all(line.startswith(' ' * 17) for line in lines[1:])
    assert 'L13 (12 messages)' in ' '.join(' '.join(lines).split())


def test_a_rule_that_is_kept_is_one_line():
    assert list(verdict_lines(Verdict('W6', PASS), 'step ids follow each other', 80)) == [
        'PASS        W6   step ids follow each other']


def test_a_message_has_no_empty_fields_and_the_beginning_of_long_ones():
    text = message_text(WORLD)
    assert 'starts=(0, 1, 2, 3, 1 more)' in text and "rows=('.....G', '......')" in text
    assert 'available' not in text and 'table' not in text and 'positions' not in text
    assert message_text(OBSERVATION) == repr(OBSERVATION)


def test_the_verdicts_are_test_cases(tmp_path):
    path = tmp_path / 'check.xml'
    verdicts = (FAILED, Verdict('W6', PASS), Verdict('W7', NOT_REACHED))
    titles = {'L13': 'no step is skipped', 'W6': 'order', 'W7': 'starts'}
    write_junit(path, '/learner', verdicts, titles, {'L13': FailureBag(tmp_path / 'L13', 3)})
    suite = ElementTree.parse(path).getroot()
    assert [suite.get(name) for name in ('tests', 'failures', 'skipped')] == ['3', '1', '1']
    assert [case.get('name') for case in suite] == ['L13 no step is skipped', 'W6 order',
                                                    'W7 starts']
    assert 'an action' in suite[0][0].get('message') and '(3 messages)' in suite[0][0].text


def test_a_bag_has_the_messages_in_their_order_with_their_times(tmp_path):
    transcript = (Received(5.0, WORLD), Received(5.5, OBSERVATION), Received(5.75, ACTION))
    bag = write_bag(tmp_path / 'bags' / 'L13', 'learner', transcript, '/robot')
    assert str(bag) == f'{tmp_path}/bags/L13 (3 messages)'
    found = list(Bag(bag.path))
    assert [each.topic for each in found] == ['/robot/world', '/robot/state', '/robot/action']
    assert [each.time - found[0].time for each in found] == [0, 500_000_000, 750_000_000]
    assert reader(STATE)(found[1].data) == OBSERVATION
    (_, world), *others = DecodedMessages(Bag(bag.path))
    assert is_same_world(world, WORLD) and others == [('state', OBSERVATION), ('action', ACTION)]


@pytest.mark.parametrize('name, reason', [
    ('bags/L13', 'exists already'), ('bags/L13/metadata.yaml/L13', 'file exists')])
def test_a_bag_that_cannot_be_written_is_said_in_the_report(tmp_path, name, reason):
    assert write_bag(tmp_path / 'bags/L13', 'learner', (), '').problem == ''
    bag = write_bag(tmp_path / name, 'learner', (), '')
    assert str(bag) == f'not written: {tmp_path / name} ({reason})'
