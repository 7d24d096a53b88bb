# SPDX-License-Identifier: Apache-2.0
"""`scripts/interfaces`: start every node, read its interfaces from the graph, write two pages."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
import rclpy
from rclpy.parameter import parameter_value_to_python
from rclpy.topic_endpoint_info import TopicEndpointInfo

from comply_ros.nodes.node_processes import ended_with_block, NodeProcess, parameter_arguments
from comply_ros.nodes.parameters import (
    ADVISING,
    BAG,
    BUDGET,
    ENV,
    OWN_ADVICE_TIMEOUT,
    Parameter,
    PORT,
    TEACH,
)
from comply_ros.nodes.ros_start import start_rclpy
from comply_ros.terminal.interrupts import interrupts
from comply_ros.terminal.standard_output import standard_output
from tools.interfaces_markdown import Endpoint, NodeInterfaces, NodeKind, pages_of
from tools.ros_graph import (
    call,
    GraphNode,
    QUIET,
    SERVICES_OF_EVERY_NODE,
    settled,
    TOPICS_OF_EVERY_NODE,
)

START_TIMEOUT = 90.0  # seconds
PARAMETERS_OF_EVERY_NODE = {'start_type_description_service', 'use_sim_time'}


Endpoints = tuple[tuple[Endpoint, ...], ...]  # publishers, subscribers, servers, clients

NODE_KINDS = (
    NodeKind('grid_world', 'grid_world', 'grid_world'),
    NodeKind('gym_world', 'gym_world', 'gym_world', {ENV: 'FrozenLake-v1'}),
    NodeKind('mentor', 'mentor', 'mentor'),
    NodeKind('mentor', 'mentor', 'mentor', {BUDGET: 1, ADVISING: 'mistakes'},
             'with a `budget` and `advising:=mistakes`'),
    NodeKind('learner', 'learner', 'learner', {OWN_ADVICE_TIMEOUT: 0.0}),
    NodeKind('viewer', 'viewer', 'viewer'),
    NodeKind('dashboard', 'dashboard', 'dashboard', {PORT: 0, TEACH: 'true'}),
    NodeKind('mentor of the dashboard', 'dashboard', 'mentor',
             {PORT: 0, TEACH: 'true'}),
    NodeKind('record', 'record', 'record', {BAG: '{folder}/bag'}),
    NodeKind('fault_injector', 'fault_injector', 'fault_injector'),
)


def main(argv: Sequence[str]) -> int:
    """Write the pages to a folder, or to standard output; return the exit code."""
    start_rclpy(['interfaces'])
    try:
        texts = pages()
    finally:
        rclpy.try_shutdown()
    if len(argv) > 1:
        Path(argv[1]).mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (Path(argv[1]) / name).write_text(text)
    else:
        sys.stdout.write('\n'.join(texts.values()))
    return 0


def pages() -> dict[str, str]:
    """Return the text of each page by its file name; starts one node of each kind."""
    with interrupts() as stop:
        return _pages(GraphNode('_interfaces', stop))


def _pages(node: GraphNode) -> dict[str, str]:
    try:
        with running(NODE_KINDS) as namespaces:
            found = _settled_endpoints(node, namespaces)
            return pages_of([_node_interfaces(node, kind, namespace, endpoints)
                             for (kind, namespace), endpoints in zip(namespaces, found)])
    finally:
        node.destroy_node()


@contextmanager
def running(kinds: Sequence[NodeKind]) -> Generator[list[tuple[NodeKind, str]]]:
    """Run a node of each kind; yield each kind with the namespace of its node."""
    with tempfile.TemporaryDirectory() as folder:
        namespaces = [(kind, f'/interfaces_{os.getpid()}_{number}')
                      for number, kind in enumerate(kinds)]
        with ended_with_block() as started:
            for kind, namespace in namespaces:
                place = Path(folder) / namespace.strip('/')
                place.mkdir()
                parameters = {
                    each.name: value.format(folder=place) if isinstance(value, str) else value
                    for each, value in kind.parameters.items()}
                arguments = ['-r', f'__ns:={namespace}', *parameter_arguments(parameters)]
                started.append(NodeProcess(kind.executable, arguments, place))
            _wait_until_ready(started)
            yield namespaces


def _wait_until_ready(processes: Sequence[NodeProcess]) -> None:
    """
    Return when every node has logged that it is ready.

    Raises
    ------
    NodeDied: if one ends.
    TimeoutError: if one is not ready in time.

    """
    end = time.monotonic() + START_TIMEOUT
    for process in processes:
        while 'ready' not in process.log.read_text(errors='replace'):
            process.check()
            if time.monotonic() > end:
                raise TimeoutError(f'{process.name} was not ready within {START_TIMEOUT:g} s; '
                                   f'its last lines:\n{process.last_lines()}')
            time.sleep(0.01)


def _settled_endpoints(node: GraphNode,
                       namespaces: Sequence[tuple[NodeKind, str]]) -> list[Endpoints]:
    """Return the endpoints of each node, once the graph is complete and does not change."""
    def look() -> list[Endpoints]:
        return [_endpoints(node, kind.node, namespace) for kind, namespace in namespaces]

    def is_complete(seen: list[Endpoints]) -> bool:
        return all(len(servers) >= len(SERVICES_OF_EVERY_NODE)
                   and not any('UNKNOWN' in end for end in (*publishers, *subscribers))
                   for publishers, subscribers, servers, _ in seen)
    return settled(node, look, START_TIMEOUT, is_complete, 2.0 * QUIET)


def _endpoints(node: GraphNode, name: str, namespace: str) -> Endpoints:
    """Return the endpoints of a node; four empty tuples until it is in the graph."""
    if (name, namespace) not in node.get_node_names_and_namespaces():
        return (), (), (), ()

    def relative(full: str) -> str:
        return full.removeprefix(f'{namespace}/')

    def of_topic(info: TopicEndpointInfo, topic: str) -> Endpoint:
        return Endpoint(relative(topic), info.topic_type, info.qos_profile.reliability.name,
                        info.qos_profile.durability.name)
    topics = (
        tuple(of_topic(info, topic) for topic, _ in sorted(names(name, namespace))
              if topic not in TOPICS_OF_EVERY_NODE for info in infos(topic)
              if (info.node_name, info.node_namespace) == (name, namespace))
        for names, infos in (
            (node.get_publisher_names_and_types_by_node, node.get_publishers_info_by_topic),
            (node.get_subscriber_names_and_types_by_node, node.get_subscriptions_info_by_topic)))
    services = (tuple(Endpoint(relative(each), kinds[0])
                      for each, kinds in sorted(names(name, namespace)))
                for names in (node.get_service_names_and_types_by_node,
                              node.get_client_names_and_types_by_node))
    return *topics, *services


def _node_interfaces(node: GraphNode, kind: NodeKind, namespace: str,
                     endpoints: Endpoints) -> NodeInterfaces:
    """`NodeInterfaces` of a node; its parameters are read from the node itself."""
    publishers, subscribers, servers, clients = endpoints
    own = {f'{kind.node}/{each}' for each in SERVICES_OF_EVERY_NODE}
    servers = tuple(end._replace(name=end.name.replace(f'{kind.node}/', '~/', 1))
                    for end in servers if end.name not in own)
    return NodeInterfaces(kind, publishers, subscribers, servers, clients, tuple(
        _parameters(node, f'{namespace}/{kind.node}', kind.parameters)))


def _parameters(node: GraphNode, name: str,
                given: Mapping[Parameter, Any]) -> Iterator[tuple[ParameterDescriptor, Any]]:
    """Yield the descriptor and the default of each parameter of a node."""
    listed = call(node, ListParameters, f'{name}/list_parameters', ListParameters.Request(),
                  START_TIMEOUT)
    names = [each for each in listed.result.names if each not in PARAMETERS_OF_EVERY_NODE
             and not each.startswith('qos_overrides.')]
    descriptors = call(node, DescribeParameters, f'{name}/describe_parameters',
                       DescribeParameters.Request(names=names), START_TIMEOUT).descriptors
    values = call(node, GetParameters, f'{name}/get_parameters',
                  GetParameters.Request(names=names), START_TIMEOUT).values
    defaults = {parameter.name: parameter.default for parameter in given}
    for descriptor, value in zip(descriptors, values):
        yield descriptor, defaults.get(descriptor.name, parameter_value_to_python(value))


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
