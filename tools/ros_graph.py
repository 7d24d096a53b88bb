# SPDX-License-Identifier: Apache-2.0
"""What `topic`, `service` and `param` share: the command line, discovery, and service calls."""

import argparse
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from importlib import import_module
import os
import sys
import time
from typing import Any, TypeVar

import rclpy
from rclpy.node import Node

from comply_ros.nodes.ros_start import rclpy_errors, start_rclpy
from comply_ros.terminal.command_line import CommandParser, real_number
from comply_ros.terminal.interrupts import check, interrupts, StopFlag
from comply_ros.terminal.standard_output import is_closed

Seen = TypeVar('Seen')
NamesAndTypes = Iterable[tuple[str, Sequence[str]]]

SERVICES_OF_EVERY_NODE = (
    'describe_parameters', 'get_parameter_types', 'get_parameters', 'get_type_description',
    'list_parameters', 'set_parameters', 'set_parameters_atomically')
TOPICS_OF_EVERY_NODE = {'/parameter_events', '/rosout'}
QUIET = 1.2  # seconds without a change after which discovery counts as complete


class GraphNode(Node):
    """A node whose command ends at Ctrl-C, but never inside of rclpy: that would raise errors."""

    def __init__(self, name: str, stop: StopFlag) -> None:
        super().__init__(name)
        self._stop = stop

    def spin(self, seconds: float) -> None:
        """Wait for a callback so long, and run it; raises KeyboardInterrupt after Ctrl-C."""
        check(self._stop)
        rclpy.spin_once(self, timeout_sec=seconds)
        check(self._stop)


# A subcommand: name, function of the node and its options, help, and the arguments (of an option
# with a short one, both) with the settings of `add_argument`.
Command = tuple[
    str, Callable[[GraphNode, argparse.Namespace], int], str, Mapping[str, dict[str, Any]]]


class GraphError(ValueError):
    """Something that is not in the graph, or does not answer; the message names it."""


def command_parser(name: str, text: str, commands: Iterable[Command]) -> argparse.ArgumentParser:
    """`ArgumentParser` with subcommands."""
    parser, commands = CommandParser(name, description=text), tuple(commands)
    words = ','.join(word for word, *_ in commands)
    subparsers = parser.add_subparsers(required=True, metavar=f'{{{words}}}')
    for word, run, meaning, arguments in commands:
        command = subparsers.add_parser(word, help=meaning, description=meaning)
        command.set_defaults(run=run)
        command.add_argument('--timeout', type=real_number, default=5.0, metavar='SECONDS',
                             help='how long to wait for the graph (default: %(default)s)')
        for argument, settings in arguments.items():
            command.add_argument(*argument.split(), **settings)
    return parser


def run_command(parser: argparse.ArgumentParser, argv: Sequence[str]) -> int:
    """Run the subcommand of the command line with a node; return the exit code."""
    given = parser.parse_args(argv[1:])
    start_rclpy([parser.prog])
    try:
        with interrupts() as stop:
            with rclpy_errors('the node could not be created: '):
                node = GraphNode(f'_{parser.prog}', stop)
            return given.run(node, given)
    except GraphError as mistake:
        print(f'{parser.prog}: {mistake}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 0
    finally:
        rclpy.try_shutdown()


def spin_while_read(node: GraphNode, is_done: Callable[[], object] = lambda: False) -> None:
    """Spin until it is done; raises BrokenPipeError where nobody reads the output any more."""
    while not is_done():
        node.spin(0.1)
        if is_closed():
            raise BrokenPipeError


def full_name(name: str) -> str:
    """Return a name as the graph has it, with a leading `/`."""
    return name if name.startswith('/') else f'/{name}'


def find(node: GraphNode, look: Callable[[], NamesAndTypes], name: str, timeout: float,
         kind: str) -> tuple[str, str]:
    """
    Return the full name and the type of a topic or service.

    look: returns all names and types.
    kind: 'topic' or 'service', for the error.

    Raises
    ------
    GraphError: if there is none of this name.

    """
    name = full_name(name)
    types = dict(settled(node, look, timeout, lambda seen: name in dict(seen), 0.0))
    if name not in types:
        raise GraphError(missing(kind, name, types))
    return name, types[name][0]


def missing(kind: str, name: str, existing: Collection[str]) -> str:
    """Return the error for a name that is not in the graph, with those that are."""
    names = [each for each in existing if each.rpartition('/')[2] not in SERVICES_OF_EVERY_NODE]
    return (f'there is no {kind} {name!r} in ROS domain {os.environ.get("ROS_DOMAIN_ID", 0)}; '
            f'there are {", ".join(sorted(names)) or "none"}')


def type_named(kind: str) -> type:
    """
    Return the class of a type such as `std_srvs/srv/Trigger`.

    Raises
    ------
    GraphError: if it is not installed here.

    """
    try:
        package, group, name = kind.split('/')
        return getattr(import_module(f'{package}.{group}'), name)
    except (ValueError, ImportError, AttributeError):
        raise GraphError('a type must be one that is installed here, such as '
                         f'std_srvs/srv/Trigger, got {kind!r}') from None


def settled(node: GraphNode, look: Callable[[], Seen], timeout: float,
            is_complete: Callable[[Seen], object], quiet: float = QUIET) -> Seen:
    """Return what `look` sees once it is complete and unchanged for `quiet` s, or at the end."""
    end, seen, since = time.monotonic() + timeout, look(), time.monotonic()
    while time.monotonic() < end and not (
            is_complete(seen) and time.monotonic() - since >= quiet):
        node.spin(0.05)
        now = look()
        if now != seen:
            seen, since = now, time.monotonic()
    return seen


def call(node: GraphNode, kind: Any, name: str, request: Any, timeout: float) -> Any:
    """
    Return the response of a service.

    Raises
    ------
    GraphError: if there is no such service, or it does not respond in time.

    """
    client, end = node.create_client(kind, name), time.monotonic() + timeout
    try:
        while not client.service_is_ready() and time.monotonic() < end:
            node.spin(0.05)
        if not client.service_is_ready():
            raise GraphError(f'there is no server of {name!r} within {timeout:g} s')
        future = client.call_async(request)
        while not future.done() and time.monotonic() < end:
            node.spin(0.05)
        if not future.done():
            raise GraphError(f'service {name!r} did not respond within {timeout:g} s')
        return future.result()
    finally:
        node.destroy_client(client)
