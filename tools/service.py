# SPDX-License-Identifier: Apache-2.0
"""`service list | type | call`, for machines without the `ros2` command line."""

import argparse
from collections.abc import Mapping, Sequence
import sys
from typing import Any

from rosidl_parser.definition import AbstractSequence, Array, NamespacedType

from comply_ros.storage.text_and_yaml_files import load_yaml, YamlError
from comply_ros.terminal.standard_output import standard_output
from tools.ros_graph import (
    call,
    command_parser,
    find,
    GraphError,
    GraphNode,
    run_command,
    settled,
    type_named,
)


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    return run_command(command_parser('service', 'Look at services, and call one.', (
        ('list', show_list, 'names of all services', {}),
        ('type', show_type, 'the type of a service', {'service': {}}),
        ('call', show_response, 'call a service: NAME TYPE [VALUES, such as "{data: true}"]',
         {'service': {}, 'type': {}, 'values': {'nargs': '?'}}))), argv)


def show_list(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the names of all services."""
    for name, _ in sorted(settled(node, lambda: _services(node), given.timeout, bool)):
        print(name)
    return 0


def show_type(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the type of a service."""
    print(find(node, lambda: _services(node), given.service, given.timeout, 'service')[1])
    return 0


def show_response(node: GraphNode, given: argparse.Namespace) -> int:
    """Call a service and print the response; exit code 1 if its `success` is false."""
    kind: Any = type_named(given.type)
    if not hasattr(kind, 'Request'):
        raise GraphError(f'a service must have the type of a service, got {given.type!r}')
    request = filled(kind.Request(check_fields=True), values_of(given.values), given.type)
    name, actual = find(node, lambda: _services(node), given.service, given.timeout, 'service')
    if actual != given.type:
        raise GraphError(f'service {name!r} has the type {actual}, got {given.type!r}')
    print(f'requester: making request: {request!r}\n', flush=True)
    response = call(node, kind, name, request, given.timeout)
    print(f'response:\n{response!r}\n')
    return 0 if getattr(response, 'success', True) else 1


def _services(node: GraphNode) -> list[tuple[str, list[str]]]:
    """Names and types of all services but those of this command's own node."""
    own = f'/{node.get_name()}/'
    return [each for each in node.get_service_names_and_types() if not each[0].startswith(own)]


def values_of(text: str | None) -> dict[str, Any]:
    """
    Return the table that a YAML text contains.

    Raises
    ------
    GraphError: if it contains none, or numbers that are not decimal.

    """
    try:
        values = load_yaml(text or '{}').value
    except YamlError as error:
        raise GraphError(error.about('the values of a request')) from None
    if not isinstance(values, dict):
        raise GraphError('the values of a request must be a table in YAML such as '
                         f'"{{data: true}}", got {text!r}')
    return values


def filled(message: Any, values: Mapping[str, Any], kind: str) -> Any:
    """
    Set fields of a message, which must check its fields, from a table; return the message.

    kind: its type, for the error.

    Raises
    ------
    GraphError: if there is no such field, or it cannot have that value.

    """
    types: dict[str, str] = message.get_fields_and_field_types()
    slots = dict(zip(types, message.SLOT_TYPES))
    for name, value in values.items():
        if name not in slots:
            raise GraphError(f'{kind} has no field {name!r}; it has '
                             f'{", ".join(slots) or "no fields"}')
        try:
            setattr(message, name, _field_value(slots[name], value, kind))
        except GraphError:
            raise
        except (AssertionError, TypeError, ValueError, OverflowError):
            raise GraphError(
                f'field {name} of {kind} must be {types[name]}, got {value!r}') from None
    return message


def _field_value(slot: Any, value: Any, kind: str) -> Any:
    """Return a value as a field takes it: tables become messages, integers become doubles."""
    if isinstance(slot, NamespacedType):
        made = type_named('/'.join(slot.namespaced_name()))(check_fields=True)
        if not isinstance(value, dict):
            raise TypeError
        return filled(made, value, kind)
    if isinstance(slot, (AbstractSequence, Array)) and isinstance(value, list):
        return [_field_value(slot.value_type, each, kind) for each in value]
    is_float = getattr(slot, 'typename', '') in ('float', 'double')
    if is_float and not isinstance(value, bool):
        return float(value)
    return value


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
