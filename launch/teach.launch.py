# SPDX-License-Identifier: Apache-2.0
"""Start the grid world, the mentor and the learner: `ros2 launch comply_ros teach.launch.py`."""

from pathlib import Path

from ament_index_python import get_package_prefix, PackageNotFoundError
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

DEFAULT_FILE = PathJoinSubstitution([FindPackageShare('comply_ros'), 'config', 'teach.yaml'])
# Name, default and meaning; an empty one leaves the parameter to the file, and to its default.
ARGUMENTS = (
    ('map', '', 'name of a map that comes with the package, or a file'),
    ('method', '', 'how to learn'),
    ('mentor', '', 'optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, none; with @C '
     'behind it, in a share C of the states only'),
    ('seed', '', 'seed of the world and the learner'),
    ('iterations', '', 'how long to learn; 0: without end'),
    ('profile', '', "settings of the report's text, or of the published runs"),
    ('namespace', '', 'of the three nodes, for a second robot'),
    ('params_file', DEFAULT_FILE, 'further parameters; the arguments above win'),
    ('state_dir', '', 'folder in which the nodes keep what they need to go on after a kill'),
    ('respawn', 'false', 'start a node again that was killed; with state_dir nothing is lost'),
    ('viewer', 'false', 'turn what is said into maps, markers and numbers that RViz shows'),
    ('rviz', 'false', 'show them in RViz, where rviz2 is installed; starts the viewer too'),
    ('log_level', 'info', 'how much the nodes say'),
)
CHOICES = {
    'method': [
        '', 'sarsa', 'q_learning', 'sarsa_lambda', 'watkins', 'constant', 'vanishing',
        'beta_implicit', 'explicit', 'beta_implicit_off_policy', 'explicit_off_policy',
        'constant_lambda', 'vanishing_lambda', 'beta_implicit_lambda', 'explicit_lambda',
        'pi_reuse', 'policy_shaping', 'jump_start', 'head_start'],
    'profile': ['', 'report', 'published'],
    'respawn': ['true', 'false'],
    'viewer': ['true', 'false'],
    'rviz': ['true', 'false'],
    'log_level': ['debug', 'info', 'warn', 'error', 'fatal'],
}
# Each node, and the arguments that set parameters of it.
NODES = {
    'grid_world': ('map', 'profile', 'seed', 'state_dir'),
    'mentor': ('mentor', 'state_dir'),
    'learner': ('method', 'profile', 'seed', 'iterations', 'state_dir'),
}
# What RViz shows; in a namespace it finds them there.
SHOWN = ('map', 'trust', 'values', 'places', 'mentor', 'policy', 'trail', 'robot')
NUMBERS = ('seed', 'iterations')
REFUSED = 2  # exit code of a node that cannot do what it was told, and could not the next time


def when_ended(name, respawns):
    """Return the handler of a node's end: all end with it, unless it is started again."""
    def handle(event, context):
        if context.is_shutdown or (respawns and event.returncode != REFUSED):
            return None
        return Shutdown(reason=f'{name} has ended')
    return handle


def nodes(context):
    """Return the three nodes; raises ValueError if there is no `params_file`."""
    given = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    if not Path(given['params_file']).is_file():  # launch would warn, and start without it
        raise ValueError(f'params_file must be a file, got {given["params_file"]!r}')
    respawns, started = given['respawn'] == 'true', []
    for name, arguments in NODES.items():
        values = {each: ParameterValue(LaunchConfiguration(each),
                                       value_type=None if each in NUMBERS else str)
                  for each in arguments if given[each]}
        started.append(Node(
            package='comply_ros', executable=name, name=name, namespace=given['namespace'],
            parameters=[given['params_file'], values],  # the file first, so that arguments win
            arguments=['--ros-args', '--enclave', f'/{name}', '--log-level', given['log_level']],
            output='screen', emulate_tty=True, respawn=respawns, respawn_delay=0.5,
            on_exit=when_ended(name, respawns)))
    return [*started, *viewers(given)]


def viewers(given):
    """Return the viewer and RViz, as far as they are asked for; they may end without the rest."""
    started, home = [], given['namespace'].strip('/')
    if 'true' in (given['viewer'], given['rviz']):
        started.append(Node(
            package='comply_ros', executable='viewer', name='viewer', namespace=home,
            parameters=[given['params_file']], output='screen', emulate_tty=True,
            arguments=['--ros-args', '--enclave', '/viewer', '--log-level', given['log_level']]))
    if given['rviz'] == 'true':
        check_rviz()
        started.append(Node(
            package='rviz2', executable='rviz2', name='rviz', namespace=home,
            arguments=['-d', PathJoinSubstitution(
                [FindPackageShare('comply_ros'), 'rviz', 'teach.rviz'])],
            remappings=[(f'/view/{each}', f'/{home}/view/{each}') for each in SHOWN if home]))
    return started


def check_rviz():
    """Return if RViz is installed; raises ValueError if it is not."""
    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        raise ValueError('rviz:=true needs the package rviz2, and it is not installed: install '
                         'it (sudo apt install ros-$ROS_DISTRO-rviz2), or give viewer:=true '
                         'alone and look with Foxglove') from None


def generate_launch_description():
    """Return the arguments and the nodes."""
    arguments = [DeclareLaunchArgument(name, default_value=default, description=text,
                                       choices=CHOICES.get(name))
                 for name, default, text in ARGUMENTS]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
