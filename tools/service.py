# SPDX-License-Identifier: Apache-2.0
"""`service list | type | call`, for machines without the `ros2` command line."""

import sys

from rosidl_parser.definition import AbstractSequence, Array, NamespacedType
import yaml

from tools.ros_graph import (
    call,
    command_parser,
    find,
    GraphError,
    run_command,
    settled,
    type_named,
)


def main(argv):
    """Run the command; return the exit code."""
    return run_command(command_parser('service', 'Look at services, and call one.', (
        ('list', show_list, 'names of all services', {}),
        ('type', show_type, 'the type of a service', {'service': {}}),
        ('call', show_response, 'call a service: NAME TYPE [VALUES, such as "{data: true}"]',
         {'service': {}, 'type': {}, 'values': {'nargs': '?'}}))), argv)


def show_list(node, given):
    """Print the names of all services."""
    for name, _ in sorted(settled(node, lambda: _others(node), given.timeout, bool)):
        print(name)
    return 0


def show_type(node, given):
    """Print the type of a service."""
    print(find(node, lambda: _others(node), given.service, given.timeout, 'service')[1])
    return 0


def show_response(node, given):
    """Call a service and print what it answers; exit code 1 where it says `success` is false."""
    kind = type_named(given.type)
    if not hasattr(kind, 'Request'):
        raise GraphError(f'a service must have the type of a service, got {given.type!r}')
    request = filled(kind.Request(check_fields=True), _values(given.values), given.type)
    name, there = find(node, lambda: _others(node), given.service, given.timeout, 'service')
    if there != given.type:
        raise GraphError(f'service {name!r} has the type {there}, got {given.type!r}')
    print(f'requester: making request: {request!r}\n', flush=True)
    response = call(node, kind, name, request, given.timeout)
    print(f'response:\n{response!r}\n')
    return 0 if getattr(response, 'success', True) else 1


def _others(node):
    """Return (name, types) of all services but those of this command's node."""
    own = f'/{node.get_name()}/'
    return [each for each in node.get_service_names_and_types() if not each[0].startswith(own)]


def _values(text):
    """
    Return the table that a text in YAML says.

    Raises
    ------
    GraphError: if it says none.

    """
    try:
        values = yaml.safe_load(text or '{}')
    except (yaml.YAMLError, ValueError, RecursionError):
        values = None
    if not isinstance(values, dict):
        raise GraphError('the values of a request must be a table in YAML such as '
                         f'"{{data: true}}", got {text!r}')
    return values


def filled(message, values, kind):
    """
    Return the message, which has to check its fields, with them set from a table.

    kind: its type, for the sentence.

    Raises
    ------
    GraphError: if it has no such field, or the field cannot have that value.

    """
    slots = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES))
    for name, value in values.items():
        if name not in slots:
            raise GraphError(f'{kind} has no field {name!r}; it has '
                             f'{", ".join(slots) or "no fields"}')
        try:
            setattr(message, name, _made(slots[name], value, kind))
        except (AssertionError, TypeError, ValueError, OverflowError) as error:
            if isinstance(error, GraphError):
                raise
            wanted = message.get_fields_and_field_types()[name]
            raise GraphError(f'field {name} of {kind} must be {wanted}, got {value!r}') from None
    return message


def _made(slot, value, kind):
    """Return a value as a field takes it: tables become messages, whole numbers doubles."""
    if isinstance(slot, NamespacedType):
        made = type_named('/'.join(slot.namespaced_name()))(check_fields=True)
        if not isinstance(value, dict):
            raise TypeError
        return filled(made, value, kind)
    if isinstance(slot, (AbstractSequence, Array)) and isinstance(value, list):
        return [_made(slot.value_type, each, kind) for each in value]
    is_number = getattr(slot, 'typename', '') in ('float', 'double')
    if is_number and not isinstance(value, bool):
        return float(value)
    return value


if __name__ == '__main__':
    sys.exit(main(sys.argv))
