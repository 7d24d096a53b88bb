# SPDX-License-Identifier: Apache-2.0
"""The text of the pages on nodes and messages, from the interfaces of the running nodes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import ParameterDescriptor

from comply_ros.nodes import topics
from comply_ros.nodes.parameters import Parameter
from tools.message_definitions import Definition, definitions
from tools.param import KINDS

NODES_PAGE, MESSAGES_PAGE = 'nodes.md', 'messages.md'  # in docs/reference

NODES_HEAD = f"""# Nodes

All topics, services and parameters of the nodes; [Messages]({MESSAGES_PAGE}) has the fields of
their messages. `scripts/interfaces` generates both pages: it starts each node and reads its
interfaces from the ROS graph. A test fails if the pages no longer agree with the nodes. [The
tutorial](../tutorial.md) shows the interfaces at work.

All names are relative, so a namespace gives a second robot; only `/diagnostics` is shared by the
whole system. `~/` stands for the name of the node, as in `/grid_world/`. `scripts/topic`,
`scripts/service` and `scripts/param` call `ros2 topic`, `ros2 service` and `ros2 param`, or
replace them where there is no `ros2`.
"""

MESSAGES_HEAD = f"""# Messages

Every message and service that the nodes define or serve, field by field. [Nodes]({NODES_PAGE})
has the topics and services on which they are used, and [the conversation](
../concepts/conversation.md) the order in which they are published. `scripts/interfaces` generates
this page from the definitions. `ros2 interface show comply_msgs/msg/StateReward` prints the same.
"""

DELIVERY = """\
Reliable and transient local topics are *latched*: late subscribers receive the last messages, as
many as the depth says. Volatile topics keep none. Subscribe to a latched topic with
`DurabilityPolicy.TRANSIENT_LOCAL` to receive these messages. Publish on it with the same policy:
the nodes do not receive messages from a volatile publisher. The table has the QoS that the
publishers offer. The ROS graph does not contain the depth; it comes from
`comply_ros/nodes/topics.py`.
"""

OF_EVERY_NODE = """\
Each node also has what every ROS 2 node has: the topics `/rosout` and `/parameter_events`, the
services `~/list_parameters`, `~/describe_parameters`, `~/get_parameters`, `~/set_parameters`, ...,
and the parameters `use_sim_time` and `start_type_description_service`.

*Read-only* parameters are set at the start. You can set the others while the node runs.
"""

NOTES = {
    'fault_injector': 'For each NAME in `topics` it subscribes to `NAME/before` and publishes on '
    '`NAME`, with the message type and the QoS of the publisher, as soon as there is one.'}
# What services do whose type does not say it.
PURPOSES = {
    '~/pause': 'Pause the world (true) or resume it (false); no message is lost.',
    '~/step': 'Take one step while the world is paused.',
    ('grid_world', '~/reset'): 'Start a new run, as after a fresh start.',
    ('gym_world', '~/reset'): 'Start a new run, as after a fresh start.',
    ('learner', '~/reset'): 'Forget everything that was learned.'}
DEFINED_HERE = ('comply_msgs', 'std_srvs')  # packages with definitions on the page


class NodeKind(NamedTuple):
    """
    A node that the pages describe.

    Attributes
    ----------
    name: its heading.
    executable: what is started.
    node: the name of the node.
    parameters: values that are not the defaults; {folder} stands for a fresh folder.
    condition: text for what it has and the one before it with this name has not.

    """

    name: str
    executable: str
    node: str
    parameters: Mapping[Parameter, Any] = {}
    condition: str = ''


class Endpoint(NamedTuple):
    """A publisher, subscriber, server or client: relative name and type; of topics the QoS."""

    name: str
    kind: str
    reliability: str = ''
    durability: str = ''


class NodeInterfaces(NamedTuple):
    """Endpoints of a node, sorted; and its parameters with their defaults, in their order."""

    kind: NodeKind
    publishers: tuple[Endpoint, ...]
    subscribers: tuple[Endpoint, ...]
    servers: tuple[Endpoint, ...]
    clients: tuple[Endpoint, ...]
    parameters: tuple[tuple[ParameterDescriptor, Any], ...]


def pages_of(nodes: Sequence[NodeInterfaces]) -> dict[str, str]:
    """Text of each page by its file name; `nodes` are in the order of the page."""
    unconditional = [each for each in nodes if not each.kind.condition]
    return {
        NODES_PAGE: '\n'.join([
            NODES_HEAD, '## Topics\n', _topics(nodes), DELIVERY, '## Services\n',
            _services(unconditional), '## Nodes\n', OF_EVERY_NODE, *map(_node, unconditional)]),
        MESSAGES_PAGE: '\n'.join([
            MESSAGES_HEAD, '## Messages\n', *_messages(nodes), '## Service definitions\n',
            *_service_definitions(unconditional)])}


def _table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Text of a table; pipes and line ends in cells are escaped."""
    heads = list(heads)
    lines = ['| ' + ' | '.join(heads) + ' |', '|' + '---|' * len(heads)]
    lines += ['| ' + ' | '.join(cell.replace('|', '\\|').replace('\n', ' ') for cell in row) + ' |'
              for row in rows]
    return '\n'.join(lines) + '\n'


def _topics(nodes: Iterable[NodeInterfaces]) -> str:
    """Text of the table of all topics, with their publishers and subscribers."""
    depths = {each.name: each.qos.depth for each in vars(topics).values()
              if isinstance(each, topics.Topic)}
    names: dict[tuple[str, str], tuple[list[str], list[str]]] = {}
    ends: dict[tuple[str, str], tuple[list[Endpoint], list[Endpoint]]] = {}
    for node in nodes:
        label = f'`{node.kind.node}`'
        words = f'{label} {node.kind.condition}'.strip()
        for side, endpoints in enumerate((node.publishers, node.subscribers)):
            for end in endpoints:
                key = end.name, end.kind
                ends.setdefault(key, ([], []))[side].append(end)
                column = names.setdefault(key, ([], []))[side]
                if not any(each.startswith(label) for each in column):
                    column.append(words)
    return _table(('topic', 'message', 'publishers', 'subscribers', 'QoS', 'depth'), (
        (f'`{name}`', _type(kind), ', '.join(publishers) or 'any',
         ', '.join(subscribers) or 'tools such as RViz',
         _qos(ends[name, kind][0] or ends[name, kind][1]), str(depths.get(name, '')))
        for (name, kind), (publishers, subscribers) in sorted(names.items())))


def _qos(ends: Iterable[Endpoint]) -> str:
    return '; '.join(sorted({
        f'{end.reliability.lower()}, {end.durability.lower().replace("_", " ")}'
        for end in ends}))


def _type(kind: str) -> str:
    """Name of a type, with a link to its definition if the page of messages has it."""
    package, _, name = kind.split('/')
    link = f'[`{kind}`]({MESSAGES_PAGE}#{name.lower()})'
    return link if package in DEFINED_HERE else f'`{kind}`'


def _services(nodes: Iterable[NodeInterfaces]) -> str:
    return _table(('service', 'type', 'node', 'purpose'), (
        (f'`{end.name}`', _type(end.kind), f'`{node.kind.name}`', purpose(node.kind.node, end))
        for node in nodes for end in node.servers))


def purpose(node: str, end: Endpoint) -> str:
    """Return what a service does; '' if nothing says it."""
    return (PURPOSES.get((node, end.name)) or PURPOSES.get(end.name)
            or (definitions(end.kind)[0].text if end.kind.startswith('comply_msgs') else ''))


def _node(node: NodeInterfaces) -> str:
    """Text of the section of a node."""
    lines = [f'### {node.kind.name}\n', f'`scripts/run {node.kind.executable}`, '
             f'`ros2 run comply_ros {node.kind.executable}`\n']
    for words, ends in (('Publishes on', node.publishers), ('Subscribes to', node.subscribers),
                        ('Serves', node.servers), ('Calls', node.clients)):
        if ends:
            lines.append(f'* {words} ' + ', '.join(f'`{end.name}`' for end in ends))
    lines += [NOTES[node.kind.name]] if node.kind.name in NOTES else []
    return '\n'.join(lines) + '\n\n' + _table(
        ('parameter', 'type', 'default', 'allowed', '', 'meaning'),
        (_parameter(descriptor, default) for descriptor, default in node.parameters))


def _parameter(descriptor: ParameterDescriptor, default: Any) -> tuple[str, ...]:
    ranges = [f'{_number(each.from_value)} to {_number(each.to_value)}'
              for each in (*descriptor.floating_point_range, *descriptor.integer_range)]
    allowed = ', '.join([*ranges, descriptor.additional_constraints]).strip(', ')
    return (f'`{descriptor.name}`', KINDS[descriptor.type].name, f'`{_value(default)}`', allowed,
            'read-only' if descriptor.read_only else '', descriptor.description)


def _value(value: Any) -> str:
    """Return a value as it is written on a command line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return '[' + ', '.join(map(_value, value)) + ']'
    return repr(value) if value == '' else str(value)


def _number(value: float) -> str:
    return f'{value:g}' if value % 1 or abs(value) < 1e4 else f'{int(value):,}'


def _messages(nodes: Iterable[NodeInterfaces]) -> Iterator[str]:
    """Yield the text of the definition of every message on a topic, and of those in them."""
    kinds = {end.kind for node in nodes for end in (*node.publishers, *node.subscribers)}
    kinds |= {f'comply_msgs/msg/{field.kind}' for kind in kinds if kind.startswith('comply_msgs')
              for field in definitions(kind)[0].fields if field.kind[0].isupper()}
    for kind in sorted(kinds, key=lambda kind: kind.split('/')[-1]):
        if kind.startswith(DEFINED_HERE):
            definition, = definitions(kind)
            yield (f'### {kind.split("/")[-1]}\n\n{definition.text}\n\n'
                   + _definition(definition))


def _service_definitions(nodes: Iterable[NodeInterfaces]) -> Iterator[str]:
    """Yield the text of the definition of every service."""
    kinds = {end.kind for node in nodes for end in node.servers}
    for kind in sorted(kinds, key=lambda kind: kind.split('/')[-1]):
        request, response = definitions(kind)
        yield (f'### {kind.split("/")[-1]}\n\n{request.text or f"Defined by `{kind}`."}\n\n'
               + _half('Request', request) + '\n' + _half('Response', response))


def _half(name: str, definition: Definition) -> str:
    return f'{name}:\n\n{_definition(definition)}' if definition.fields else f'{name}: empty\n'


def _definition(definition: Definition) -> str:
    """Text of the constants and fields of a definition."""
    constants = [f'`{each.name}` {each.value}' for each in definition.fields
                 if each.value is not None]
    head = f'Constants: {", ".join(constants)}\n\n' if constants else ''
    return head + _table(('field', 'type', 'meaning'), (
        (f'`{each.name}`', f'`{each.kind}`', each.text)
        for each in definition.fields if each.value is None))
