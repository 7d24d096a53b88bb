# SPDX-License-Identifier: Apache-2.0
"""`scripts/demo --teach`: a world, a learner, and a page on which a person is the mentor."""

import argparse
from contextlib import contextmanager
import sys

from comply_ros.dashboard import server
from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.nodes.lesson import lock_topics
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.run_monitor import LessonFailed
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.storage.map_files import map_names, read_map
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.terminal.training_options import guarded
from comply_ros.world.grid import MapError

RATE = 100.0  # steps a second at first: a robot to look at, and a curve that moves


def demo_parser():
    """`ArgumentParser` of the demo."""
    parser = argparse.ArgumentParser(
        'demo --teach', description='Be the mentor of a learner, on a page in the browser.')
    add = parser.add_argument
    add('--map', default='maze', metavar='NAME|FILE',
        help=f'{", ".join(map_names())}, or a map file (default: %(default)s)')
    add('--method', default='beta_implicit', choices=METHODS['published'], metavar='NAME',
        help=f'{", ".join(METHODS["published"])} (default: %(default)s)')
    add('--port', type=int, default=8080, help='of the page (default: %(default)s)')
    add('--out', default='runs/demo', metavar='DIR',
        help='for what the nodes print (default: %(default)s)')
    return parser


def main(argv):
    """Run the demo until Ctrl-C; return the exit code."""
    given = demo_parser().parse_args(argv[1:])
    use_kernel_cache()
    return guarded('demo', (MapError, ConfigError, OutputError, LessonFailed), lambda: run(given))


def run(given):
    """Run the world and the learner as processes, and the page in this one; return its code."""
    read_map(given.map, 'published')
    find_method(given.method, 'published')
    print('Open the address below in a browser and paint arrows; Ctrl-C ends the demo.',
          file=sys.stderr)
    with lock_topics(''), pupils(given, prepare_folder(given.out)):
        return server.main(['dashboard', '--ros-args', '-p', f'port:={given.port}'])


@contextmanager
def pupils(given, folder):
    """Run a world and a learner that asks its mentor at every step, while the block runs."""
    started = []
    try:
        for name, values in (
                ('grid_world', {'map': given.map, 'rate': RATE}),
                ('learner', {'method': given.method, 'iterations': 0,
                             'remembers_advice': 'false', 'map_period': 0.5})):
            started.append(NodeProcess(name, [each for key, value in values.items()
                                              for each in ('-p', f'{key}:={value}')], folder))
        yield
    finally:
        for process in started:
            process.interrupt()
        for process in started:
            process.wait()


if __name__ == '__main__':
    sys.exit(main(sys.argv))
