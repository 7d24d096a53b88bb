# SPDX-License-Identifier: Apache-2.0
"""What running nodes show of themselves in the graph; docs/interfaces.md is made of it."""

from contextlib import contextmanager
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import NamedTuple

from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
import rclpy
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.parameters import ADVISING, BAG, BUDGET, PORT
from tools.interfaces_markdown import page_of
from tools.ros_graph import call, OF_EVERY_NODE, QUIET, settled

START = 30.0  # seconds that a node has to start
OWN_TOPICS = {'/parameter_events', '/rosout'}  # that every node has
OWN_PARAMETERS = {'start_type_description_service', 'use_sim_time'}  # that every node has


class Sort(NamedTuple):
    """
    A sort of node to look at.

    Attributes
    ----------
    name: its heading.
    executable: what is started.
    node: the name of the node.
    given: table of values by `Parameter`, which are not the defaults; {folder} is a fresh one.
    only: words for what is seen of it and not of the one before it with that name.

    """

    name: str
    executable: str
    node: str
    given: dict = {}
    only: str = ''


class End(NamedTuple):
    """One end of a topic or service: relative name, type, and for topics how it is delivered."""

    name: str
    kind: str
    reliability: str = ''
    durability: str = ''


class RemoteParameter(NamedTuple):
    """A parameter: its descriptor and its default."""

    described: object
    value: object


class Shown(NamedTuple):
    """What one node shows: sorted `End`s, and its `RemoteParameter`s in the order of declaration."""

    sort: Sort
    speaks: tuple
    hears: tuple
    serves: tuple
    calls: tuple
    settings: tuple


SORTS = (
    Sort('grid_world', 'grid_world', 'grid_world'),
    Sort('mentor', 'mentor', 'mentor'),
    Sort('mentor', 'mentor', 'mentor', {BUDGET: 1, ADVISING: 'mistakes'},
         'with a `budget` and `advising:=mistakes`'),
    Sort('learner', 'learner', 'learner'),
    Sort('viewer', 'viewer', 'viewer'),
    Sort('dashboard', 'dashboard', 'dashboard', {PORT: 0}),
    Sort('mentor of the dashboard', 'dashboard', 'mentor', {PORT: 0}),
    Sort('record', 'record', 'record', {BAG: '{folder}/bag'}),
    Sort('fault_injector', 'fault_injector', 'fault_injector'),
)


def main(argv):
    """Write the page to the file that is named, or to standard output; return the exit code."""
    rclpy.init()
    try:
        text = page()
    finally:
        rclpy.try_shutdown()
    if len(argv) > 1:
        Path(argv[1]).write_text(text)
    else:
        sys.stdout.write(text)
    return 0


def page():
    """Return the text of docs/interfaces.md; starts one node of each sort."""
    node = Node('_interfaces')
    try:
        with running(SORTS) as spaces:
            looks = _looked_at(node, spaces)
            return page_of([_shown(node, sort, space, seen)
                            for (sort, space), seen in zip(spaces, looks)])
    finally:
        node.destroy_node()


@contextmanager
def running(sorts):
    """Run a node of each sort; yield pairs (sort, namespace of its own)."""
    with tempfile.TemporaryDirectory() as folder:
        spaces = [(sort, f'/interfaces_{os.getpid()}_{number}')
                  for number, sort in enumerate(sorts)]
        started = []
        try:
            for sort, space in spaces:
                log = Path(folder) / space.strip('/')
                log.mkdir()
                started.append(NodeProcess(
                    sort.executable, ['-r', f'__ns:={space}', *_arguments(sort, log)], log))
            _wait_for(started)
            yield spaces
        finally:
            for process in started:
                process.interrupt()
            for process in started:
                process.wait()


def _arguments(sort, folder):
    """Yield the ROS arguments that give parameters their values."""
    for parameter, value in sort.given.items():
        yield from ('-p', f'{parameter.name}:={str(value).format(folder=folder)}')


def _wait_for(processes):
    """
    Return when every node has said that it is ready.

    Raises
    ------
    NodeDied: if one ends.
    TimeoutError: if one is not ready in time.

    """
    end = time.monotonic() + START
    for process in processes:
        while 'ready' not in process.log.read_text(errors='replace'):
            process.check()
            if time.monotonic() > end:
                raise TimeoutError(f'{process.name} was not ready within {START:g} s; its last '
                                   f'lines:\n{process.last_lines()}')
            time.sleep(0.01)


def _looked_at(node, spaces):
    """Return what the graph shows of each node, once it is complete and does not change."""
    def look():
        return [_ends(node, sort.node, space) for sort, space in spaces]

    def is_complete(seen):
        return all(len(services) >= len(OF_EVERY_NODE) and all(
            'UNKNOWN' not in end for each in ends[:2] for end in each)
            for *ends, services, _ in seen)
    return settled(node, look, START, is_complete, 2.0 * QUIET)


def _ends(node, name, space):
    """(speaks, hears, serves, calls) of a node; four empty ones before it is there."""
    if (name, space) not in node.get_node_names_and_namespaces():
        return (), (), (), ()
    topics = (
        tuple(_end_of_topic(end, topic, space) for topic, _ in sorted(names(node, name, space))
              if topic not in OWN_TOPICS for end in ends(node, topic)
              if (end.node_name, end.node_namespace) == (name, space))
        for names, ends in (
            (Node.get_publisher_names_and_types_by_node, Node.get_publishers_info_by_topic),
            (Node.get_subscriber_names_and_types_by_node, Node.get_subscriptions_info_by_topic)))
    services = (tuple(End(_relative(each, space), kinds[0])
                      for each, kinds in sorted(look(node, name, space)))
                for look in (Node.get_service_names_and_types_by_node,
                             Node.get_client_names_and_types_by_node))
    return *topics, *services


def _end_of_topic(end, topic, space):
    return End(_relative(topic, space), end.topic_type, end.qos_profile.reliability.name,
               end.qos_profile.durability.name)


def _relative(name, space):
    return name.removeprefix(f'{space}/')


def _shown(node, sort, space, seen):
    """`Shown` of a node, its parameters asked from itself."""
    speaks, hears, serves, calls = seen
    own = {f'{sort.node}/{each}' for each in OF_EVERY_NODE}
    serves = tuple(end._replace(name=end.name.replace(f'{sort.node}/', '~/', 1))
                   for end in serves if end.name not in own)
    return Shown(sort, speaks, hears, serves, calls,
                 tuple(_settings(node, f'{space}/{sort.node}', sort.given)))


def _settings(node, name, given):
    """Yield the `RemoteParameter` of each parameter of a node, with its default."""
    listed = call(node, ListParameters, f'{name}/list_parameters', ListParameters.Request(), START)
    names = [each for each in listed.result.names if each not in OWN_PARAMETERS]
    described = call(node, DescribeParameters, f'{name}/describe_parameters',
                     DescribeParameters.Request(names=names), START).descriptors
    values = call(node, GetParameters, f'{name}/get_parameters',
                  GetParameters.Request(names=names), START).values
    defaults = {parameter.name: parameter.default for parameter in given}
    for each, value in zip(described, values):
        yield RemoteParameter(each, defaults.get(each.name, parameter_value_to_python(value)))


if __name__ == '__main__':
    sys.exit(main(sys.argv))
