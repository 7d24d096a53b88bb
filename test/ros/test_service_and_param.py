# SPDX-License-Identifier: Apache-2.0
"""`scripts/service` and `scripts/param`, for machines without `ros2`."""

import re

from comply_msgs.srv import Recommend
from node_processes import log_has, nodes, run_tool
import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import SetParameters
from ros_domain import own_domain
from waiting import wait_until

from tools.param import value_of
from tools.ros_graph import GraphError
from tools.service import filled, values_of


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    """Run a world and its mentor, in a domain of their own."""
    with pytest.MonkeyPatch.context() as monkeypatch, own_domain(monkeypatch) as number, \
            nodes(tmp_path_factory.mktemp('nodes'), grid_world=('-p', 'map:=bar_grid'),
                  mentor=('-p', 'mentor:=optimal')) as started:
        wait_until(log_has(started['mentor'], 'advises'), 'policy')
        yield number


def wait_until_listed(words, tool):
    """Wait until a list has all the words: on a busy machine a node may be found late."""
    def is_listed():
        listed = run_tool(tool, 'list').stdout
        return all(each in listed for each in words)
    wait_until(is_listed, f'{words} in the list of {tool}')


def test_a_parameter_is_listed_described_set_and_read(running):
    assert '  rate\n' in run_tool('param', 'list', '/grid_world').stdout
    wait_until_listed(('/grid_world:\n  map\n', '/mentor:\n  advising\n'), 'param')
    assert run_tool('param', 'describe', 'grid_world', 'rate').stdout == (
        'Parameter name: rate\n  Type: double\n'
        '  Description: Steps per second; 0: as fast as possible\n'
        '  Constraints:\n    Min value: 0.0\n    Max value: 1000.0\n')
    done = run_tool('param', 'set', '/grid_world', 'rate', '25')
    assert done.stdout == 'Set parameter successful\n'
    assert run_tool('param', 'get', '/grid_world', 'rate').stdout == 'Double value is: 25.0\n'


@pytest.mark.parametrize('argv, error', [
    (('set', '/grid_world', 'rate', '5000'), 'setting parameter failed: Parameter rate out of'),
    (('set', '/grid_world', 'rate', '-1e3'), 'setting parameter failed: Parameter rate out of'),
    (('set', '/grid_world', 'rate', 'fast'), "parameter rate must be a double, got 'fast'"),
    (('set', '/grid_world', 'seed', '1.5'), "parameter seed must be an integer, got '1.5'"),
    (('set', '/grid_world', 'map', 'maze'), 'setting parameter failed: Trying to set a read-only'),
    (('get', '/grid_world', 'speed'), "node '/grid_world' has no parameter 'speed'; it has map,"),
    (('get', '/gridworld', 'rate', '--timeout', '1'), "there is no node '/gridworld' in ROS dom")])
@pytest.mark.long
def test_a_value_that_cannot_be_set_is_one_line_and_exit_code_1(running, argv, error):
    done = run_tool('param', *argv)
    assert (done.returncode, done.stdout, done.stderr.count('\n')) == (1, '', 1)
    assert done.stderr.startswith(f'param: {error}')


def test_a_service_is_listed_and_called(running):
    wait_until_listed(('/recommend\n',), 'service')
    assert run_tool('service', 'type', 'recommend').stdout == 'comply_msgs/srv/Recommend\n'
    done = run_tool('service', 'call', '/recommend', 'comply_msgs/srv/Recommend', '{state: 5}')
    assert done.returncode == 0
    assert done.stdout.startswith(
        'requester: making request: comply_msgs.srv.Recommend_Request(state=5)\n\nresponse:\n'
        "comply_msgs.srv.Recommend_Response(success=True, message='', action=")


def test_a_response_without_success_gives_exit_code_1(running):
    done = run_tool('service', 'call', '/recommend', 'comply_msgs/srv/Recommend', '{state: 50000}')
    assert done.returncode == 1 and 'success=False' in done.stdout


@pytest.mark.parametrize('argv, error', [
    (('/recommend', 'std_srvs/srv/Trigger'),
     "service '/recommend' has the type comply_msgs/srv/Recommend, got 'std_srvs/srv/Trigger'"),
    (('/recommend', 'Recommend'), 'a type must be one that is installed here, such as '
     "std_srvs/srv/Trigger, got 'Recommend'"),
    (('/recommend', 'comply_msgs/msg/Action'),
     "a service must have the type of a service, got 'comply_msgs/msg/Action'"),
    (('/recommend', 'comply_msgs/srv/Recommend', '{state: up}'),
     "field state of comply_msgs/srv/Recommend must be uint32, got 'up'"),
    (('/recommend', 'comply_msgs/srv/Recommend', '{cell: 5}'),
     "comply_msgs/srv/Recommend has no field 'cell'; it has state"),
    (('/recommend', 'comply_msgs/srv/Recommend', '{state: 5'), 'the values of a request must be '
     "valid YAML (expected ',' or '}', but got '<stream end>')")])
@pytest.mark.long
def test_a_call_that_cannot_be_made_is_one_line_and_exit_code_1(running, argv, error):
    done = run_tool('service', 'call', *argv)
    assert (done.returncode, done.stdout, done.stderr) == (1, '', f'service: {error}\n')


@pytest.mark.long
def test_a_service_that_does_not_exist_is_named_with_those_that_do(running):
    done = run_tool('service', 'call', '/advise', 'comply_msgs/srv/Recommend')
    assert done.returncode == 1
    assert done.stderr == (f"service: there is no service '/advise' in ROS domain {running}; "
                           'there are /grid_world/pause, /grid_world/reset, /grid_world/step, '
                           '/recommend\n')


@pytest.mark.parametrize('text, sentence', [
    ('{state: 010}', "a number must be written like 10, 0.5 or 1e-3, got '010'"),
    ('{state: 0x10}', "a number must be written like 10, 0.5 or 1e-3, got '0x10'"),
    ('{state', 'the values of a request must be valid YAML'),
    ('state', 'the values of a request must be a table in YAML')])
def test_values_of_a_request_are_read_as_all_yaml_is(text, sentence):
    with pytest.raises(GraphError, match=re.escape(sentence)):
        values_of(text)


def test_nested_fields_of_a_request_are_filled():
    request = filled(SetParameters.Request(check_fields=True), {'parameters': [
        {'name': 'rate', 'value': {'type': 3, 'double_value': 2}}]}, 'SetParameters')
    assert request.parameters[0].value.double_value == 2.0
    assert filled(Recommend.Request(check_fields=True), {}, 'Recommend').state == 0
    with pytest.raises(GraphError, match='field parameters of X must be sequence'):
        filled(SetParameters.Request(check_fields=True), {'parameters': 3}, 'X')


@pytest.mark.parametrize('kind, text, field, value', [
    (ParameterType.PARAMETER_DOUBLE, '1', 'double_value', 1.0),
    (ParameterType.PARAMETER_DOUBLE, '1e-3', 'double_value', 0.001),
    (ParameterType.PARAMETER_DOUBLE, '-1e3', 'double_value', -1000.0),
    (ParameterType.PARAMETER_STRING, '1', 'string_value', '1'),
    (ParameterType.PARAMETER_BOOL, 'false', 'bool_value', False),
    (ParameterType.PARAMETER_STRING_ARRAY, '[a, b]', 'string_array_value', ['a', 'b']),
    (ParameterType.PARAMETER_DOUBLE_ARRAY, '[1, 2.5]', 'double_array_value', [1.0, 2.5])])
def test_a_value_has_the_type_of_its_parameter(kind, text, field, value):
    message = value_of('p', kind, text)
    assert message.type == kind
    assert getattr(message, field) == value or list(getattr(message, field)) == value


@pytest.mark.parametrize('kind, text', [
    (ParameterType.PARAMETER_DOUBLE, '010'), (ParameterType.PARAMETER_INTEGER, '010'),
    (ParameterType.PARAMETER_DOUBLE, '1:30'), (ParameterType.PARAMETER_BOOL, '1'),
    (ParameterType.PARAMETER_INTEGER, 'true'),
    (ParameterType.PARAMETER_INTEGER, '9999999999999999999'),
    (ParameterType.PARAMETER_DOUBLE, '{'), (ParameterType.PARAMETER_STRING_ARRAY, '[1]'),
    (ParameterType.PARAMETER_DOUBLE_ARRAY, '1.0')])
def test_a_value_of_another_type_is_rejected(kind, text):
    with pytest.raises(GraphError, match='parameter p must be an? '):
        value_of('p', kind, text)
