# SPDX-License-Identifier: Apache-2.0
"""`scripts/demo --teach`: a world, a learner, and a page on which you are the mentor."""

import argparse
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
import sys

from comply_ros.dashboard import server
from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.nodes.lesson import lock_topics
from comply_ros.nodes.lesson_processes import namespace_arguments, ros_namespace
from comply_ros.nodes.node_processes import NodeProcess, parameter_arguments, run_nodes
from comply_ros.nodes.run_monitor import LessonFailed
from comply_ros.storage.map_files import read_map
from comply_ros.storage.map_name import map_names, OTHER_MAPS
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.terminal.training_options import guarded
from comply_ros.world.grid import MapError


def option_parser() -> argparse.ArgumentParser:
    """Parser of the demo's options."""
    parser = CommandParser(
        'demo --teach', description='Be the mentor of a learner, on a page in the browser.')
    add = parser.add_argument
    add('--map', default='maze', metavar='NAME|FILE',
        help=f'{", ".join(map_names())}, {OTHER_MAPS} (default: %(default)s)')
    add('--method', default='beta_implicit', metavar='NAME',
        help=f'{", ".join(METHODS["published"])} (default: %(default)s)')
    add('--port', type=whole_number, default=8080, help='port of the page (default: %(default)s)')
    add('--out', default='runs/demo', metavar='DIR',
        help='folder for the output of the nodes (default: %(default)s)')
    add('--namespace', type=ros_namespace, default='', metavar='NAME',
        help='of the nodes, for a second lesson at the same time')
    return parser


def main(argv: list[str]) -> int:
    """Run the demo until Ctrl-C; return the exit code."""
    options = option_parser().parse_args(argv[1:])
    return guarded('demo', (MapError, ConfigError, OutputError, LessonFailed),
                   lambda: run(options))


def run(options: argparse.Namespace) -> int:
    """Run world and learner as processes, and the page in this one; return its exit code."""
    read_map(options.map, 'published')
    find_method(options.method, 'published')
    print('Open the address below in a browser and paint arrows; Ctrl-C ends the demo.',
          file=sys.stderr)
    with lock_topics(options.namespace), world_and_learner(
            options, prepare_folder(options.out)) as processes:
        return server.main(['dashboard', '--ros-args',
                            *parameter_arguments({'port': options.port}),
                            *namespace_arguments(options.namespace)], processes)


@contextmanager
def world_and_learner(options: argparse.Namespace, folder: Path) -> Generator[list[NodeProcess]]:
    """Run a world, and a learner that asks its mentor in every step, while the block runs."""
    parameters = {'grid_world': {'map': options.map, 'rate': 100.0},
                  'learner': {'method': options.method, 'iterations': 0,
                              'remembers_advice': False, 'map_period': 0.5}}
    namespace = namespace_arguments(options.namespace)
    with run_nodes({name: [*parameter_arguments(values), *namespace]
                    for name, values in parameters.items()}, folder) as processes:
        yield processes
