# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the environment is said in one sentence by whatever starts rclpy."""

from node_processes import run, run_tool
import pytest

from comply_ros.executables import EXECUTABLES

pytestmark = pytest.mark.usefixtures('domain')
NODES = tuple(name for name, (module, _) in EXECUTABLES.items()
              if module.startswith(('nodes.', 'dashboard.')))
TOOLS = (('topic', 'list'), ('service', 'list'), ('param', 'list'), ('soak',),
         ('interface_pages',))
LOGS = ('environment variable {name} must lead to a folder for log files that can be written, got '
        '{value!r}: set ROS_LOG_DIR to another folder')
MIDDLEWARE = ('environment variable RMW_IMPLEMENTATION must name a middleware that is installed '
              '(rmw_fastrtps_cpp), got {value!r}: unset it, or install that ROS package')
DOMAIN = 'environment variable ROS_DOMAIN_ID must be an integer in [0, 232], got {value!r}'
SWITCH = 'environment variable {name} must be 0 or 1, got {value!r}'
SECURITY = ('environment variable ROS_SECURITY_ENABLE needs a ROS with security, and a keystore '
            'in ROS_SECURITY_KEYSTORE, got none')
WRONG = [('ROS_LOG_DIR', '/proc/no/folder', LOGS),
         ('ROS_LOG_DIR', '/proc', LOGS),
         ('ROS_HOME', '/proc/no', LOGS),
         ('RMW_IMPLEMENTATION', 'rmw_none_cpp', MIDDLEWARE),
         ('ROS_DOMAIN_ID', 'kitchen', DOMAIN),
         ('ROS_DOMAIN_ID', '233', DOMAIN),
         ('RCUTILS_COLORIZED_OUTPUT', 'yes', SWITCH),
         ('ROS_STATIC_PEERS', 'no host', 'environment variable ROS_STATIC_PEERS must have '
          'addresses of hosts, got {value!r}')]
WORST = [WRONG[0], WRONG[3]]


@pytest.mark.parametrize('name, value, rule', WRONG)
def test_a_node_names_the_variable_that_is_to_blame(name, value, rule):
    done = run('grid_world', **{name: value})
    assert done.stderr.splitlines() == ['grid_world: ' + rule.format(name=name, value=value)]
    assert done.returncode == 2


@pytest.mark.parametrize('program', NODES)
@pytest.mark.parametrize('name, value, rule', WORST)
@pytest.mark.long
def test_every_executable_names_the_variable(program, name, value, rule, tmp_path):
    arguments = {'lesson': ('--out', str(tmp_path)), 'check': ('mentor',)}.get(program, ())
    done = run(program, *arguments, **{name: value})
    assert done.stderr.splitlines() == [f'{program}: ' + rule.format(name=name, value=value)]
    assert done.returncode == 2


@pytest.mark.parametrize('program', TOOLS, ids=lambda words: words[0])
@pytest.mark.parametrize('name, value, rule', WORST)
@pytest.mark.long
def test_every_tool_names_the_variable(program, name, value, rule, tmp_path, monkeypatch):
    monkeypatch.setenv(name, value)
    out = ('--out', str(tmp_path)) if program[0] == 'soak' else ()
    done = run_tool(*program, *out)
    assert done.stderr.splitlines()[-1] == f'{program[0]}: ' + rule.format(name=name, value=value)
    assert 'Traceback' not in done.stderr and done.returncode == 2


def test_security_that_is_switched_on_without_a_keystore_is_named(monkeypatch):
    monkeypatch.delenv('ROS_SECURITY_KEYSTORE', raising=False)
    done = run('viewer', ROS_SECURITY_ENABLE='true', ROS_SECURITY_STRATEGY='Enforce')
    assert done.stderr.startswith('viewer: ' + SECURITY) and done.returncode == 2
