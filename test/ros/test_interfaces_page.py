# SPDX-License-Identifier: Apache-2.0
"""The pages on nodes and messages in docs/reference agree with the running nodes."""

from pathlib import Path

import pytest
import rclpy

from comply_ros.nodes import topics
from tools.interface_pages import NODE_KINDS, pages
from tools.interfaces_markdown import Endpoint, MESSAGES_PAGE, NodeKind, NODES_PAGE, purpose
from tools.message_definitions import definitions, Field, parse_definition

FOLDER = Path(__file__).parents[2] / 'docs' / 'reference'
PAGE = FOLDER / NODES_PAGE


@pytest.fixture
def generated(domain):
    """Return the pages that are generated from the nodes now."""
    rclpy.init()
    try:
        yield pages()
    finally:
        rclpy.try_shutdown()


def test_the_pages_agree_with_the_running_nodes(generated):
    stored = {name: (FOLDER / name).read_text() for name in (NODES_PAGE, MESSAGES_PAGE)}
    if generated != stored:
        new, old = ([*dict.fromkeys(line for name in (NODES_PAGE, MESSAGES_PAGE)
                                    for line in texts[name].splitlines())]
                    for texts in (generated, stored))
        differences = [f'+ {line}' for line in new if line not in old] + [
            f'- {line}' for line in old if line not in new]
        pytest.fail('docs/reference is stale: run scripts/interfaces\n' + '\n'.join(differences))


def test_every_topic_is_on_the_page():
    text = PAGE.read_text()
    for each in vars(topics).values():
        if isinstance(each, topics.Topic):
            assert f'\n| `{each.name}` |' in text


def test_every_node_is_on_the_page_with_all_its_columns():
    text = PAGE.read_text()
    assert all(f'\n### {kind.name}\n' in text for kind in NODE_KINDS)
    rows = [line for line in text.splitlines() if line.startswith('| `')]
    assert len(rows) > 100
    assert not [row for row in rows if row.rstrip(' |').count('|') < 2]


def test_every_service_on_the_page_has_a_purpose():
    table = PAGE.read_text().split('## Services\n')[1].split('## Nodes\n')[0]
    rows = [line for line in table.splitlines() if line.startswith('| `')]
    assert len(rows) >= 2
    assert not [row for row in rows if row.endswith('|  |')]
    assert purpose('learner', Endpoint('~/nothing', 'std_srvs/srv/Trigger')) == ''


def test_a_node_that_does_not_start_is_named(domain, monkeypatch):
    from comply_ros.nodes.node_processes import NodeDied
    from comply_ros.nodes.parameters import MENTOR
    from tools import interface_pages
    broken = NodeKind('mentor', 'mentor', 'mentor', {MENTOR: 'nobody'})
    monkeypatch.setattr(interface_pages, 'NODE_KINDS', (broken,))
    rclpy.init()
    try:
        with pytest.raises(NodeDied, match='mentor ended with exit code 2'):
            pages()
    finally:
        rclpy.try_shutdown()


def test_a_definition_is_read_with_its_comments():
    definition = parse_definition('# What it\n# is.\n\nint8 UP=3\n# Before\nfloat64 x  # behind\n'
                                  '# two\n# lines\nstring[] names\n\n# lost\n\nbool last')
    assert definition.text == 'What it is.'
    assert definition.fields == (
        Field('int8', 'UP', '3', ''), Field('float64', 'x', None, 'behind'),
        Field('string[]', 'names', None, 'two lines'), Field('bool', 'last', None, ''))


def test_a_comment_right_before_the_first_field_belongs_to_it():
    assert parse_definition('# of x\nint8 x') == ('', (Field('int8', 'x', None, 'of x'),))


def test_a_service_has_two_halves_and_one_of_them_may_be_empty():
    request, response = definitions('std_srvs/srv/Trigger')
    assert request.fields == ()
    assert [each.name for each in response.fields] == ['success', 'message']
