# SPDX-License-Identifier: Apache-2.0
"""docs/interfaces.md says what the running nodes say."""

from pathlib import Path

import pytest
import rclpy

from comply_ros.nodes import topics
from tools.graph_snapshot import End, page, Sort, SORTS
from tools.interfaces_markdown import what
from tools.message_definitions import definitions, Field, read_definition

PAGE = Path(__file__).parents[1] / 'docs' / 'interfaces.md'


@pytest.fixture
def fresh(domain):
    """Return the page as the nodes make it now."""
    rclpy.init()
    try:
        yield page()
    finally:
        rclpy.try_shutdown()


def test_the_page_is_what_the_running_nodes_say(fresh):
    if fresh != PAGE.read_text():
        new, old = ([*dict.fromkeys(text.splitlines())] for text in (fresh, PAGE.read_text()))
        differences = [f'+ {line}' for line in new if line not in old] + [
            f'- {line}' for line in old if line not in new]
        pytest.fail('docs/interfaces.md is stale: run scripts/interfaces\n'
                    + '\n'.join(differences))


def test_every_topic_of_ours_is_on_the_page():
    text = PAGE.read_text()
    for each in vars(topics).values():
        if isinstance(each, topics.Topic):
            assert f'\n| `{each.name}` |' in text


def test_every_node_is_on_the_page_with_all_its_columns():
    text = PAGE.read_text()
    assert all(f'\n### {sort.name}\n' in text for sort in SORTS)
    rows = [line for line in text.splitlines() if line.startswith('| `')]
    assert len(rows) > 100
    assert not [row for row in rows if row.rstrip(' |').count('|') < 2]


def test_every_service_on_the_page_says_what_it_is_for():
    table = PAGE.read_text().split('## Services\n')[1].split('## Nodes\n')[0]
    rows = [line for line in table.splitlines() if line.startswith('| `')]
    assert len(rows) >= 2
    assert not [row for row in rows if row.endswith('|  |')]
    assert what('learner', End('~/nothing', 'std_srvs/srv/Trigger')) == ''


def test_a_node_that_does_not_start_is_named(domain, monkeypatch):
    from comply_ros.nodes.node_processes import NodeDied
    from comply_ros.nodes.parameters import MENTOR
    from tools import graph_snapshot
    broken = Sort('mentor', 'mentor', 'mentor', {MENTOR: 'nobody'})
    monkeypatch.setattr(graph_snapshot, 'SORTS', (broken,))
    rclpy.init()
    try:
        with pytest.raises(NodeDied, match='mentor ended with exit code 2'):
            page()
    finally:
        rclpy.try_shutdown()


def test_a_definition_is_read_with_its_comments():
    read = read_definition('# What it\n# is.\n\nint8 UP=3\n# Before\nfloat64 x  # behind\n'
                           '# two\n# lines\nstring[] names\n\n# lost\n\nbool last')
    assert read.text == 'What it is.'
    assert read.fields == (
        Field('int8', 'UP', '3', ''), Field('float64', 'x', None, 'behind'),
        Field('string[]', 'names', None, 'two lines'), Field('bool', 'last', None, ''))


def test_a_comment_right_before_the_first_field_is_its_own():
    assert read_definition('# of x\nint8 x') == ('', (Field('int8', 'x', None, 'of x'),))


def test_a_service_has_two_halves_and_one_of_them_may_be_empty():
    asked, answered = definitions('std_srvs/srv/Trigger')
    assert asked.fields == ()
    assert [each.name for each in answered.fields] == ['success', 'message']
