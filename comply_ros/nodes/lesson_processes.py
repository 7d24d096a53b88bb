# SPDX-License-Identifier: Apache-2.0
"""The processes of a lesson: which nodes, in which namespace, with which parameters."""

from contextlib import AbstractContextManager
from dataclasses import asdict
from pathlib import Path
import shutil

from rclpy.exceptions import NameValidationException
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace

from comply_ros.learner.learner_config import ConfigError
from comply_ros.mentor.mentor_policies import FROM_FILES
from comply_ros.nodes.node_processes import (
    NodeProcess,
    parameter_arguments,
    run_nodes,
    yaml_for_rcl,
)
from comply_ros.storage.file_system import absolute_path
from comply_ros.storage.map_name import absolute_name
from comply_ros.terminal.training_options import TrainingOptions

NODES = {'world': 'grid_world', 'mentor': 'mentor', 'learner': 'learner'}  # of each part
LONGEST_NAME = 'grid_world/set_parameters_atomically'  # of a topic or service in a lesson
STATE = 'state'  # folder in that of the results, for the checkpoints of `--respawn`


def check_namespace(name: str) -> None:
    """Return if the nodes of a lesson can have this namespace; raises ConfigError."""
    full = f'/{name.strip("/")}'
    try:
        validate_namespace(full)
        validate_full_topic_name(f'{full.rstrip("/")}/{LONGEST_NAME}')
    except NameValidationException as error:
        reason = str(error).partition('\n')[0].rstrip(':')
        raise ConfigError(f'--namespace must be a name that ROS nodes can have, got {name!r}: '
                          f'{reason}') from None


def namespace_arguments(name: str) -> list[str]:
    """Return the ROS arguments of a node in a namespace, none for ''."""
    return ['-r', f'__ns:=/{name.strip("/")}'] if name.strip('/') else []


def running(options: TrainingOptions, held: bool = False,
            ) -> AbstractContextManager[list[NodeProcess]]:
    """Run the three nodes as processes that end with the block, whatever happens in it."""
    arguments = ['--params-file', str(write_parameters(options))]
    shutil.rmtree(options.out / STATE, ignore_errors=True)  # of an earlier lesson
    (options.out / 'learning.npz').unlink(missing_ok=True)
    arguments += namespace_arguments(options.args.namespace)
    if options.args.rate:
        arguments += parameter_arguments({'rate': options.args.rate})
    names = [name for part, name in NODES.items() if part != options.args.external]
    return run_nodes(dict.fromkeys(names, arguments), options.out, held)


def write_parameters(options: TrainingOptions) -> Path:
    """Write the parameter file of the lesson and return its path."""
    kind, _, value = options.mentor.partition(':')
    mentor = f'{kind}:{absolute_path(value)}' if kind in FROM_FILES else options.mentor
    initial = absolute_path(options.initial_learning) if options.initial_learning else ''
    common = {'profile': options.profile, 'seed': options.seed}
    state = {'state_dir': str((options.out / STATE).resolve())} if options.args.respawn else {}
    parameters = {
        'grid_world': {'map': absolute_name(options.map_name), **common, **state},
        'mentor': {'mentor': mentor, 'seed': options.mentor_seed, 'budget': options.budget,
                   'advising': options.advising, **state},
        'learner': {'method': options.method, **common, **asdict(options.config), **state,
                    'initial_learning': initial,
                    'remembers_advice': not (options.budget and options.advising == 'mistakes')}}
    path = options.out / 'parameters.yaml'
    table = {f'/**/{name}': {'ros__parameters': values} for name, values in parameters.items()}
    path.write_text('# What this lesson was run with: --ros-args --params-file parameters.yaml\n'
                    + yaml_for_rcl(table), encoding='utf-8')
    return path
