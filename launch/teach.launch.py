# SPDX-License-Identifier: Apache-2.0
"""Start the grid world, the mentor and the learner: `ros2 launch comply_ros teach.launch.py`."""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

DEFAULT_FILE = PathJoinSubstitution([FindPackageShare('comply_ros'), 'config', 'teach.yaml'])
ARGUMENTS = (
    ('map', 'maze', 'name of a map that comes with the package, or a file'),
    ('method', 'beta_implicit', 'sarsa, q_learning, constant, vanishing, beta_implicit, explicit'),
    ('mentor', 'snapshot:0.75',
     'optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, none'),
    ('seed', '0', 'seed of the world and the learner'),
    ('profile', 'published', 'report: its text; published: the runs behind its figures'),
    ('namespace', '', 'of the three nodes, for a second robot'),
    ('params_file', DEFAULT_FILE, 'further parameters; the arguments above win'),
    ('log_level', 'info', 'debug, info, warn, error, fatal'),
)
# Each node, the parameters that arguments set, and their types.
NODES = {
    'grid_world': {'map': str, 'profile': str, 'seed': int},
    'mentor': {'mentor': str},
    'learner': {'method': str, 'profile': str, 'seed': int},
}


def node(name, parameters):
    """Return one node; the file comes first, so that the arguments win."""
    values = {each: ParameterValue(LaunchConfiguration(each), value_type=kind)
              for each, kind in parameters.items()}
    return Node(
        package='comply_ros', executable=name, name=name, output='screen', emulate_tty=True,
        namespace=LaunchConfiguration('namespace'),
        parameters=[LaunchConfiguration('params_file'), values],
        arguments=['--ros-args', '--log-level', LaunchConfiguration('log_level')])


def generate_launch_description():
    """Return the three nodes and their arguments."""
    arguments = [DeclareLaunchArgument(name, default_value=default, description=text)
                 for name, default, text in ARGUMENTS]
    return LaunchDescription(arguments + [node(*each) for each in NODES.items()])
