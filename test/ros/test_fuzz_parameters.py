# SPDX-License-Identifier: Apache-2.0
"""Odd parameter files and requests: a node has the value, or tells why not on one line."""

import os

from comply_msgs.srv import Save
from hypothesis import example, given
from hypothesis import strategies as st
from node_processes import run
import pytest
import rclpy
import yaml

from comply_ros.learner.learner_config import ConfigError
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.nodes.grid_world import check_rate, GridWorldNode
from comply_ros.nodes.learner import LearnerNode
from comply_ros.nodes.mentor import MentorNode
from comply_ros.nodes.parameters import ParameterError
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import MapError
from examples import examples

pytestmark = pytest.mark.usefixtures('domain')
MISTAKES = ParameterError, MapError, MentorError, ConfigError
GIVEN = {GridWorldNode: ('map', 'profile', 'seed', 'rate', 'use_sim_time'),
         MentorNode: ('mentor', 'seed', 'budget', 'advising'),
         LearnerNode: ('method', 'temperature', 'episodes', 'replays', 'trust', 'map_period')}
ODD = ['.nan', '-.inf', '1e999', '-0.0', '0x10', '1' + '0' * 30, '[]', '{}', '{a: 1}', '[1, a]',
       '!!int x', '&a b', '*a', '"a\\nb"', '"\\0"', '[', '%', 'yes', '~', "''", '2001-01-01',
       '[[1]]', 'file:/', 'none@1@1', 'x' * 3000]
values = st.one_of(
    st.sampled_from(ODD), st.text(max_size=9),
    st.one_of(st.integers(), st.floats(), st.booleans(), st.text(max_size=9),
              st.lists(st.integers(), max_size=2), st.integers(0, 9), st.floats(0, 1)).map(
        lambda value: yaml.safe_dump(value, default_flow_style=True).removesuffix('\n...\n')))


@pytest.fixture(scope='module')
def path(tmp_path_factory):
    """Return the path of a file that every example writes anew."""
    return tmp_path_factory.mktemp('fuzz') / 'parameters.yaml'


def start(make_node, path):
    """Return the parameters of a node with this file, None after a good message."""
    context = rclpy.Context()
    try:
        rclpy.init(context=context, args=['--ros-args', '--params-file', str(path)])
    except RuntimeError as error:
        assert "Couldn't parse params file" in str(error)
        return None
    try:
        node = make_node(context=context)
        return {name: node.get_parameter(name).value for name in GIVEN[make_node]}
    except MISTAKES as mistake:
        assert str(mistake) and str(mistake).isprintable()
        return None
    finally:
        rclpy.try_shutdown(context=context)


@examples(60)
@given(make_node=st.sampled_from(list(GIVEN)), number=st.integers(0, 5), value=values)
@example(make_node=GridWorldNode, number=2, value='[]')
@example(make_node=GridWorldNode, number=4, value='5')
@example(make_node=GridWorldNode, number=4, value='[]')
@example(make_node=GridWorldNode, number=4, value='"\\x1b[2J"')
@example(make_node=GridWorldNode, number=2, value='"a\\nb"')
def test_a_node_has_the_value_of_its_file_or_tells_why_not(path, make_node, number, value):
    name = GIVEN[make_node][number % len(GIVEN[make_node])]
    path.write_text(f'/**:\n  ros__parameters:\n    {name}: {value}\n', errors='replace')
    found = start(make_node, path)
    if found is None:
        return
    try:
        wanted = yaml.safe_load(path.read_text())['/**']['ros__parameters'][name]
    except yaml.YAMLError:
        return
    if type(wanted) is type(found[name]):
        assert found[name] == wanted


@pytest.mark.parametrize('content, sentence', [
    ('{grid_world: {ros__parameters: {rate: .nan}}}',
     'parameter rate must lie in [0, 1000], got nan'),
    ('{grid_world: {ros__parameters: {seed: []}}}',
     'parameter seed must be an integer such as 1, got []'),
    ('{grid_world: {ros__parameters: {map: []}}}', 'parameter map must be a string, got []'),
    ('{grid_world: {ros__parameters: {use_sim_time: 5}}}',
     'parameter use_sim_time must be true or false, got 5'),
    ('{grid_world: {ros__parameters: {use_sim_time: "a\\nb\\e"}}}',
     r"parameter use_sim_time must be true or false, got 'a\nb\x1b'"),
    ('{grid_world: {ros__parameters: {map: &a maze, profile: *a}}}',
     "the arguments after --ros-args must be known and valid: Couldn't parse params file: "
     "'--params-file {}'. Error: Will not support aliasing at line 1"),
    ('- a', "the arguments after --ros-args must be known and valid: Couldn't parse params file: "
     "'--params-file {}'. Error: Sequences cannot be key at line 1"),
])
def test_a_wrong_parameter_file_is_one_line_and_exit_code_2(path, content, sentence):
    path.write_text(content)
    done = run('grid_world', '--ros-args', '--params-file', str(path))
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == f'grid_world: {sentence.replace("{}", str(path))}\n'


def test_every_node_tells_a_wrong_use_sim_time_on_one_line():
    done = run('viewer', '--ros-args', '-p', 'use_sim_time:=5')
    assert (done.returncode, done.stderr) == (
        2, 'viewer: parameter use_sim_time must be true or false, got 5\n')


def test_an_unprintable_argument_is_one_printable_line():
    done = run('grid_world', '--ros-args', '-p', 'map:=\x1b[2J')
    assert (done.returncode, done.stderr.count('\n')) == (2, 1)
    assert done.stderr.removesuffix('\n').isprintable()
    done = run('grid_world', '--ros-args', '-r', '\x1b[2J')
    assert (done.returncode, done.stderr.count('\n')) == (2, 1)
    assert done.stderr.removesuffix('\n').isprintable()


def test_an_argument_that_is_not_text_is_one_line():
    done = run('grid_world', '--ros-args', '-p', b'map:=\xff')
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith(
        'grid_world: the arguments after --ros-args must be known and valid: ')
    assert done.stderr.count('\n') == 1


def test_a_table_in_place_of_a_number_is_warned_of(path, capfd):
    path.write_text('{/**: {ros__parameters: {rate: {a: 1.0}}}}')
    assert start(GridWorldNode, path)['rate'] == 0.0
    assert "parameter 'rate.a' is unknown and has no effect" in capfd.readouterr().err


@pytest.mark.parametrize('rate', [float('nan'), -1.0, 1e-9])
def test_a_rate_that_cannot_be_kept_is_rejected(rate):
    with pytest.raises(ParameterError, match='parameter rate must be 0.0 or at least 0.001, got'):
        check_rate(rate)


@pytest.fixture
def learner(tmp_path, monkeypatch):
    """Return a learner that knows a world, in a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    node = LearnerNode(context=context)
    node.on_world(WorldMachine(read_map('bar_grid', 'published'), 'bar', 1, 0).description)
    yield node
    rclpy.try_shutdown(context=context)


@pytest.mark.parametrize('path, message', [
    ('', 'the path of the file must be given, got an empty one'),
    ('a\0b', "'a\\x00b': no file can have this name"),
    ('\ud800', "'\\ud800': no file can have this name"),
    ('/', '/: there is something that is not a file'),
    ('.', '.: there is something that is not a file'),
    ('pipe', 'pipe: there is something that is not a file'),
    ('x' * 300, f'{"x" * 300}: file name too long'),
    ('x' * 5000, f'{"x" * 5000}: file name too long'),
    ('nowhere/x', 'nowhere/x: no such file or directory'),
    ('/dev/null/x', '/dev/null/x: not a directory'),
    ('~nobody-at-all/x', '~nobody-at-all/x: no such user')], ids=lambda text: ascii(text)[:20])
def test_a_path_that_cannot_be_saved_to_is_named_and_unused(learner, tmp_path, path, message):
    os.mkfifo(tmp_path / 'pipe')
    answer = learner.save(Save.Request(path=path), Save.Response())
    assert (answer.success, answer.message, answer.digest) == (False, message, '')
    assert [entry.name for entry in tmp_path.iterdir()] == ['pipe']
