# SPDX-License-Identifier: Apache-2.0
"""Values of another type than the parameter's: an integer is a double, others are named."""

import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
import rclpy
from ros_client import ros_client

from comply_ros.nodes.grid_world import GridWorldNode
from comply_ros.nodes.parameters import ParameterError

pytestmark = pytest.mark.usefixtures('domain')


def made(*arguments):
    """Return the values of the parameters map, seed and rate of a world with these arguments."""
    context = rclpy.Context()
    words = [word for argument in arguments for word in ('-p', argument)]
    rclpy.init(context=context, args=['--ros-args', '-p', 'map:=bar_grid', *words])
    try:
        node = GridWorldNode(context=context)
        return [node.get_parameter(name).value for name in ('map', 'seed', 'rate')]
    finally:
        rclpy.try_shutdown(context=context)


@pytest.mark.parametrize('text', ['50', '50.0', '5e1'])
def test_a_double_may_be_given_as_an_integer(text):
    rate = made(f'rate:={text}')[2]
    assert (rate, type(rate)) == (50.0, float)


@pytest.mark.parametrize('argument, message', [
    ('map:=1e3', 'parameter map must be a string (in quotes, as it looks like something else), '
     'got 1000.0'),
    ('map:=yes', 'parameter map must be a string (in quotes, as it looks like something else), '
     'got True'),
    ("rate:='50'", "parameter rate must be a double such as 1.0 (without quotes), got '50'"),
    ('rate:=1:30', "parameter rate must be a double such as 1.0, got '1:30'"),
    ('seed:=2.0', 'parameter seed must be an integer such as 1 (without a point), got 2.0'),
    ('rate:=5000', 'parameter rate must lie in [0, 1000], got 5000'),
    ('use_sim_time:=[]', 'parameter use_sim_time must be true or false, got []'),
    ('start_type_description_service:=[]',
     'parameter start_type_description_service must be true or false, got []')])
def test_a_value_of_another_type_is_named_with_how_to_write_it(argument, message):
    with pytest.raises(ParameterError) as caught:
        made(argument)
    assert str(caught.value) == message


INTEGER = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=50)
TEXT = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value='fast')
RATE, SEED = (Parameter(name=name, value=INTEGER) for name in ('rate', 'seed'))
FAST = Parameter(name='rate', value=TEXT)


@pytest.fixture
def world(domain):
    """Give a world, and a function that calls one of its services."""
    context = rclpy.Context()
    rclpy.init(context=context, args=['--ros-args', '-p', 'map:=bar_grid'])
    node = GridWorldNode(context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    with ros_client() as client:
        def call(kind, name, parameters):
            caller = client.create_client(kind, f'/grid_world/{name}')
            client.until(caller.service_is_ready, f'service {name}')
            future = caller.call_async(kind.Request(parameters=parameters))
            client.until(lambda: executor.spin_once(timeout_sec=0.01) or future.done(), name)
            return future.result()
        yield node, call
    executor.shutdown()
    rclpy.try_shutdown(context=context)


def test_an_integer_sets_a_double_while_the_node_runs(world):
    node, call = world
    answer = call(SetParameters, 'set_parameters', [RATE])
    assert [(each.successful, each.reason) for each in answer.results] == [(True, '')]
    assert node.get_parameter('rate').value == 50.0
    answer = call(SetParametersAtomically, 'set_parameters_atomically', [RATE])
    assert answer.result.successful


def test_each_parameter_of_another_type_has_its_own_sentence(world):
    node, call = world
    answer = call(SetParameters, 'set_parameters', [FAST, RATE, FAST, SEED])
    rule = "parameter rate must be a double such as 1.0, got 'fast'"
    assert [each.reason for each in answer.results[:3]] == [rule, '', rule]
    assert 'read-only' in answer.results[3].reason
    assert node.get_parameter('rate').value == 50.0
    answer = call(SetParametersAtomically, 'set_parameters_atomically', [RATE, FAST])
    assert (answer.result.successful, answer.result.reason) == (False, rule)
