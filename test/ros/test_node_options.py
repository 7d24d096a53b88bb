# SPDX-License-Identifier: Apache-2.0
"""Options that every node has: `--help`, log levels, QoS overrides."""

import re

from node_processes import log_has, nodes, run, run_tool
import pytest
from rcl_interfaces.srv import ListParameters
from ros_client import ros_client
from waiting import wait_until

from comply_ros.nodes.node_help import help_text, NODE_PARAMETERS
from comply_ros.nodes.parameters import ROS_PARAMETERS

pytestmark = pytest.mark.usefixtures('domain')

SMALL = ('-p', 'map:=bar_grid')
SLOW = (*SMALL, '-p', 'rate:=2.0')  # while others are looked at
STARTED = {'grid_world': SLOW, 'mentor': ('-p', 'mentor:=optimal'),
           'learner': ('-p', 'NAME.advice_timeout:=0.0'), 'viewer': (), 'fault_injector': (),
           'dashboard': ('-p', 'port:=0', '-p', 'teach:=false')}
OVERRIDE = 'qos_overrides./progress.publisher.depth'


def parameter_names(node):
    """Return the names of the parameters of a node that runs."""
    return run_tool('param', 'list', f'/{node}').stdout.split()


def test_help_names_the_parameters_that_the_nodes_have(tmp_path):
    with ros_client() as client, nodes(
            tmp_path, record=('-p', f'bag:={tmp_path / "bag"}'), **STARTED) as started:
        for name in started:
            known = {each.name for each in (*NODE_PARAMETERS[name], *ROS_PARAMETERS)}
            listed = client.call(ListParameters, f'{name}/list_parameters').result.names
            assert {each for each in listed
                    if not each.startswith('qos_overrides.')} == known, name


@pytest.mark.parametrize('name', NODE_PARAMETERS)
def test_help_fits_60_columns(name, monkeypatch):
    monkeypatch.setenv('COLUMNS', '60')
    text = help_text(name)
    assert all(f'\n  {each.name}\n' in text for each in NODE_PARAMETERS[name])
    assert max(len(line) for line in text.splitlines()[1:]) <= 60


def test_help_starts_no_node():
    done = run('grid_world', '--help')
    assert done.returncode == 0 and done.stderr == ''
    assert done.stdout.startswith('usage: grid_world [--ros-args') and '\n  rate\n' in done.stdout


@pytest.mark.long
def test_debug_is_of_our_nodes_and_not_of_rcl_unless_it_is_asked_for(tmp_path):
    with nodes(tmp_path, grid_world=(*SMALL, '--log-level', 'debug')) as started:
        wait_until(log_has(started['grid_world'], 'waits for'), 'warning')
        log = started['grid_world'].log.read_text()
    assert not re.search(r'\[(rcl|rmw|rcutils)', log)
    with nodes(tmp_path, grid_world=(*SMALL, '--log-level', 'rcl:=debug')) as started:
        wait_until(log_has(started['grid_world'], '[rcl]'), 'line of rcl')


@pytest.mark.long
def test_quality_of_service_can_be_overridden_but_not_of_the_latched_loop(tmp_path):
    with nodes(tmp_path, learner=('-p', f'{OVERRIDE}:=7'), grid_world=SLOW) as started:
        for node in started.values():
            wait_until(log_has(node, 'ready'), f'start of {node.name}')
        assert run_tool('param', 'get', '/learner', OVERRIDE).stdout == 'Integer value is: 7\n'
        overridable = [name for node in started for name in parameter_names(node)
                       if name.startswith('qos_overrides.')]
        assert any('./episode.publisher' in name for name in overridable)
        assert not [name for name in overridable for topic in (
            'world', 'state', 'action', 'recommendation') if f'./{topic}.' in name]


def test_colors_of_the_log_can_be_switched_off(tmp_path):
    done = run('grid_world', '--ros-args', '-p', 'map:=no_such_map', NO_COLOR='1')
    assert done.returncode == 2 and '\x1b' not in done.stderr
