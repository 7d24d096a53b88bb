# SPDX-License-Identifier: Apache-2.0
"""The processes of a lesson: which nodes, and in which namespace."""

from argparse import ArgumentTypeError
from contextlib import AbstractContextManager
import shutil

from rclpy.exceptions import NameValidationException
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace

from comply_ros.mentor.several_mentors import split_mentors
from comply_ros.nodes.lesson_parameters import (
    mentor_node,
    NODES,
    STATE,
    world_node,
    write_parameters,
)
from comply_ros.nodes.node_processes import NodeProcess, parameter_arguments, run_nodes
from comply_ros.terminal.training_options import TrainingOptions

LONGEST_NAME = 'grid_world/set_parameters_atomically'  # of a topic or service in a lesson


def ros_namespace(name: str) -> str:
    """Value of the option `--namespace`, for `type=`; raises the error that argparse prints."""
    full = f'/{name.strip("/")}'
    try:
        validate_namespace(full)
        validate_full_topic_name(f'{full.rstrip("/")}/{LONGEST_NAME}')
    except NameValidationException as error:
        reason = str(error).partition('\n')[0].rstrip(':')
        raise ArgumentTypeError(f'it must be a name that ROS nodes can have, got {name!r}: '
                                f'{reason}') from None
    return name


def namespace_arguments(name: str) -> list[str]:
    """Return the ROS arguments of a node in a namespace, none for ''."""
    return ['-r', f'__ns:=/{name.strip("/")}'] if name.strip('/') else []


def running(options: TrainingOptions, held: bool = False,
            ) -> AbstractContextManager[list[NodeProcess]]:
    """
    Run the nodes as processes that end with the block, whatever happens in it.

    All three, but for the one that runs already, of a lesson with an external node.
    """
    arguments = ['--params-file', str(write_parameters(options))]
    shutil.rmtree(options.out / STATE, ignore_errors=True)  # of an earlier lesson
    (options.out / 'learning.npz').unlink(missing_ok=True)
    arguments += namespace_arguments(options.args.namespace)
    if options.args.rate:
        arguments += parameter_arguments({'rate': options.args.rate})
    mentors = [mentor_node(name) for name in split_mentors(options.mentor)]
    parts = {'world': [world_node(options)], 'mentor': mentors, 'learner': [NODES[2]]}
    names = [name for part in parts if part != options.args.external for name in parts[part]]
    return run_nodes(dict.fromkeys(names, arguments), options.out, held,
                     dict.fromkeys(mentors, NODES[1]))
