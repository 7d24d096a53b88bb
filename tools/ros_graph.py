# SPDX-License-Identifier: Apache-2.0
"""What `topic`, `service` and `param` share: a node that looks round, and calls a service."""

import argparse
from importlib import import_module
import os
import sys
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

OF_EVERY_NODE = ('describe_parameters', 'get_parameter_types', 'get_parameters',
                 'get_type_description', 'list_parameters', 'set_parameters',
                 'set_parameters_atomically')  # services
QUIET = 1.2  # seconds without news after which discovery is taken to be complete


class GraphError(ValueError):
    """Something that is not there, or does not answer; the message names it."""


def run_command(parser, argv):
    """Run the `run` of the given subcommand with a node; return the exit code of the process."""
    given = parser.parse_args(argv[1:])
    rclpy.init()
    node = Node(f'_{parser.prog}')
    try:
        return given.run(node, given)
    except GraphError as mistake:
        print(f'{parser.prog}: {mistake}', file=sys.stderr)
        return 1
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        rclpy.try_shutdown()


def command_parser(name, text, commands):
    """
    `ArgumentParser` of a command with subcommands.

    commands: rows (name, function of node and options, its help, its arguments, each with the
        settings of `add_argument`).
    """
    parser = argparse.ArgumentParser(name, description=text)
    added = parser.add_subparsers(required=True, metavar='COMMAND')
    for word, run, meaning, arguments in commands:
        command = added.add_parser(word, help=meaning, description=meaning)
        command.set_defaults(run=run)
        command.add_argument('--timeout', type=float, default=5.0, metavar='SECONDS',
                             help='how long to look and wait (default: %(default)s)')
        for argument, settings in arguments.items():
            command.add_argument(argument, **settings)
    return parser


def full_name(name):
    """Return a name as the graph shows it, from `/`."""
    return name if name.startswith('/') else f'/{name}'


def find(node, look, name, seconds, kind):
    """
    (full name, type) of a topic or a service.

    look: returns pairs (name, types).
    kind: the word for it.

    Raises
    ------
    GraphError: if there is none of this name.

    """
    name = full_name(name)
    types = dict(settled(node, look, seconds, lambda seen: name in dict(seen), 0.0))
    if name not in types:
        raise GraphError(missing(kind, name, types))
    return name, types[name][0]


def missing(kind, name, there):
    """Return the sentence for something that is not in the graph, with what is."""
    there = [each for each in there if each.rpartition('/')[2] not in OF_EVERY_NODE]
    return (f'there is no {kind} {name!r} in ROS domain {os.environ.get("ROS_DOMAIN_ID", 0)}; '
            f'there are {", ".join(sorted(there)) or "none"}')


def type_named(kind):
    """
    Return the class of a type such as `std_srvs/srv/Trigger`.

    Raises
    ------
    GraphError: if this machine has no such type.

    """
    try:
        package, room, name = kind.split('/')
        return getattr(import_module(f'{package}.{room}'), name)
    except (ValueError, ImportError, AttributeError):
        raise GraphError('a type must be one that is installed here, such as '
                         f'std_srvs/srv/Trigger, got {kind!r}') from None


def settled(node, look, seconds, is_enough, quiet=QUIET):
    """Return what `look` sees once it is enough and for `quiet` s the same, or at the end."""
    end, seen, since = time.monotonic() + seconds, look(), time.monotonic()
    while time.monotonic() < end and not (is_enough(seen) and time.monotonic() - since >= quiet):
        rclpy.spin_once(node, timeout_sec=0.05)
        now = look()
        if now != seen:
            seen, since = now, time.monotonic()
    return seen


def call(node, kind, name, request, seconds):
    """
    Return the response of a service.

    Raises
    ------
    GraphError: if it is not there, or does not answer in time.

    """
    client, end = node.create_client(kind, name), time.monotonic() + seconds
    try:
        if not client.wait_for_service(seconds):
            raise GraphError(f'nobody serves {name!r} within {seconds:g} s')
        future = client.call_async(request)
        while not future.done() and time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=0.05)
        if not future.done():
            raise GraphError(f'service {name!r} did not answer within {seconds:g} s')
        return future.result()
    finally:
        node.destroy_client(client)
