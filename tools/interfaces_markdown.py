# SPDX-License-Identifier: Apache-2.0
"""The text of docs/interfaces.md, from what the nodes show and what their messages say."""

from comply_ros.nodes import topics
from tools.message_definitions import definitions
from tools.param import KINDS

HEAD = """# Interfaces

Every topic, service, parameter and message of the nodes. `scripts/interfaces` wrote this page: it
started each node and asked it, and a test fails when the page no longer says what they say.
[The tutorial](tutorial.md) shows them at work.

All names are relative, so that a namespace gives a second robot; only `/diagnostics` is one for
the whole system. `~/` stands for the node's own name, as in `/grid_world/`. `scripts/topic`,
`scripts/service` and `scripts/param` are `ros2 topic`, `ros2 service` and `ros2 param` where there
is a `ros2`, and do the same where there is none.
"""

DELIVERED = """\
Reliable and transient local is what ROS calls latched: whoever comes late gets the last
messages, as many as the topic keeps. A volatile topic has no memory. To hear what is latched,
subscribe with `DurabilityPolicy.TRANSIENT_LOCAL`; to be heard on such a topic, publish with it.
What stands here is offered by who speaks; how many a topic keeps the graph does not tell, it is
what `comply_ros/nodes/topics.py` says.
"""

OF_ALL = """\
Besides, as every node in ROS 2: the topics `/rosout` and `/parameter_events`, the services
`~/list_parameters`, `~/describe_parameters`, `~/get_parameters`, `~/set_parameters`, ..., and the
parameters `use_sim_time` and `start_type_description_service`.
"""

FIXED = '*fixed*: read at the start; the other parameters may be set while the node runs.'
NOTES = {
    'fault_injector': 'Hears `NAME/before` and speaks on `NAME` for each NAME in `topics`, as '
    'soon as somebody speaks there, with the message and the QoS that it finds.'}
WHAT = {  # of services whose type does not say it
    '~/pause': 'True pauses, false goes on; no message is lost by it.',
    '~/step': 'While it is paused, lets one question be asked and answered.',
    ('grid_world', '~/reset'): 'Begins a new run, as from a fresh start.',
    ('learner', '~/reset'): 'Forgets all that was learned.'}
FAMILIAR = ('comply_msgs', 'std_srvs')  # packages whose definitions the page shows


def page_of(shown):
    """Text of the page; shown: a `Shown` of each sort, in the order of the page."""
    whole = [each for each in shown if not each.sort.only]
    parts = [HEAD, '## Topics\n', _topics(shown), DELIVERED, '## Services\n', _services(whole),
             '## Nodes\n', OF_ALL, FIXED + '\n', *map(_node, whole),
             '## Messages\n', *_messages(shown), '## Service definitions\n', *_calls(whole)]
    return '\n'.join(parts)


def _table(heads, rows):
    """Text of a table; what would break a cell is replaced."""
    lines = ['| ' + ' | '.join(heads) + ' |', '|' + '---|' * len(heads)]
    lines += ['| ' + ' | '.join(cell.replace('|', '\\|').replace('\n', ' ') for cell in row) + ' |'
              for row in rows]
    return '\n'.join(lines) + '\n'


def _topics(shown):
    """Text of the table of all topics: who is at their ends."""
    known = {each.name: each.qos.depth for each in vars(topics).values()
             if isinstance(each, topics.Topic)}
    ends = {}
    for node in shown:
        for side, some in enumerate((node.speaks, node.hears)):
            for end in some:
                row = ends.setdefault((end.name, end.kind), ([], [], ([], [])))
                row[2][side].append(end)
                if not any(each.startswith(f'`{node.sort.node}`') for each in row[side]):
                    row[side].append(f'`{node.sort.node}`'
                                     + (f' {node.sort.only}' if node.sort.only else ''))
    return _table(('topic', 'message', 'spoken by', 'heard by', 'delivered', 'keeps'), (
        (f'`{name}`', _linked(kind), ', '.join(speak) or 'anybody', ', '.join(hear) or
         'who looks', _delivered(msg or heard), str(known.get(name, '')))
        for (name, kind), (speak, hear, (msg, heard)) in sorted(ends.items())))


def _delivered(ends):
    """Words for the QoS of the ends of a topic: what is offered, who hears may ask for less."""
    words = sorted({f'{end.reliability.lower()}, {end.durability.lower().replace("_", " ")}'
                    for end in ends})
    return '; '.join(words)


def _linked(kind):
    """Name of a type, with a link to its definition below where there is one."""
    package, _, name = kind.split('/')
    return f'[`{kind}`](#{name.lower()})' if package in FAMILIAR else f'`{kind}`'


def _services(shown):
    return _table(('service', 'type', 'of', 'what for'), (
        (f'`{end.name}`', _linked(end.kind), f'`{node.sort.name}`', what(node.sort.node, end))
        for node in shown for end in node.serves))


def what(node, end):
    """Return what a service is for; empty where nothing says it."""
    return (WHAT.get((node, end.name)) or WHAT.get(end.name)
            or (definitions(end.kind)[0].text if end.kind.startswith('comply_msgs') else ''))


def _node(node):
    """Text of what one node shows."""
    lines = [f'### {node.sort.name}\n', f'`scripts/run {node.sort.executable}`, '
             f'`ros2 run comply_ros {node.sort.executable}`\n']
    for words, ends in (('Speaks on', node.speaks), ('Hears', node.hears),
                        ('Serves', node.serves), ('Calls', node.calls)):
        if ends:
            lines.append(f'* {words} ' + ', '.join(f'`{end.name}`' for end in ends))
    lines += [NOTES[node.sort.name]] if node.sort.name in NOTES else []
    rows = [_setting(each) for each in node.settings]
    return '\n'.join(lines) + '\n\n' + _table(
        ('parameter', 'type', 'default', 'may be', '', 'meaning'), rows)


def _setting(setting):
    described, value = setting
    return (f'`{described.name}`', KINDS[described.type].name, f'`{_value(value)}`',
            _range(described), 'fixed' if described.read_only else '', described.description)


def _value(value):
    """Return a value as it is written on a command line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return '[' + ', '.join(map(_value, value)) + ']'
    return repr(value) if value == '' else str(value)


def _range(described):
    spans = [*described.floating_point_range, *described.integer_range]
    return ', '.join([f'{_number(span.from_value)} to {_number(span.to_value)}' for span in spans]
                     + [described.additional_constraints] * bool(
                         described.additional_constraints))


def _number(value):
    return f'{value:g}' if value % 1 or abs(value) < 1e4 else f'{int(value):,}'


def _messages(shown):
    """Yield the text of the definition of every message on a topic."""
    kinds = {end.kind for node in shown for end in (*node.speaks, *node.hears)}
    for kind in sorted(kinds, key=lambda kind: kind.split('/')[-1]):
        if kind.startswith(FAMILIAR):
            definition, = definitions(kind)
            yield (f'### {kind.split("/")[-1]}\n\n{definition.text}\n\n'
                   + _definition(definition))


def _calls(shown):
    """Yield the text of the definition of every service."""
    kinds = {end.kind for node in shown for end in node.serves}
    for kind in sorted(kinds, key=lambda kind: kind.split('/')[-1]):
        asked, answered = definitions(kind)
        yield (f'### {kind.split("/")[-1]}\n\n{asked.text or f"As `{kind}`."}\n\n'
               + _half('Request', asked) + '\n' + _half('Response', answered))


def _half(name, definition):
    return f'{name}:\n\n{_definition(definition)}' if definition.fields else f'{name}: empty\n'


def _definition(definition):
    """Text of the constants and fields of a definition."""
    constants = [f'`{each.name}` {each.value}' for each in definition.fields
                 if each.value is not None]
    head = f'Constants: {", ".join(constants)}\n\n' if constants else ''
    return head + _table(('field', 'type', 'meaning'), (
        (f'`{each.name}`', f'`{each.kind}`', each.text)
        for each in definition.fields if each.value is None))
