# SPDX-License-Identifier: Apache-2.0
"""`param list | get | set | describe`, for machines without the `ros2` command line."""

import argparse
from collections.abc import Callable, Sequence
import sys
from typing import Any, NamedTuple

from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.parameter import parameter_value_to_python

from comply_ros.numerics.number_text import read_integer, read_number
from comply_ros.storage.text_and_yaml_files import load_yaml
from comply_ros.terminal.standard_output import standard_output
from tools.ros_graph import (
    call,
    command_parser,
    full_name,
    GraphError,
    GraphNode,
    missing,
    QUIET,
    run_command,
    settled,
)


class Kind(NamedTuple):
    """A type of parameter: its name, the field of `ParameterValue`, and what `get` prints."""

    name: str
    field: str
    sentence: str
    type: type
    is_list: bool = False


KINDS = {
    ParameterType.PARAMETER_BOOL: Kind('boolean', 'bool_value', 'Boolean value is', bool),
    ParameterType.PARAMETER_INTEGER: Kind('integer', 'integer_value', 'Integer value is', int),
    ParameterType.PARAMETER_DOUBLE: Kind('double', 'double_value', 'Double value is', float),
    ParameterType.PARAMETER_STRING: Kind('string', 'string_value', 'String value is', str),
    ParameterType.PARAMETER_BOOL_ARRAY: Kind(
        'boolean array', 'bool_array_value', 'Boolean values are', bool, True),
    ParameterType.PARAMETER_INTEGER_ARRAY: Kind(
        'integer array', 'integer_array_value', 'Integer values are', int, True),
    ParameterType.PARAMETER_DOUBLE_ARRAY: Kind(
        'double array', 'double_array_value', 'Double values are', float, True),
    ParameterType.PARAMETER_STRING_ARRAY: Kind(
        'string array', 'string_array_value', 'String values are', str, True)}
READERS: dict[type, Callable[[str], Any]] = {
    bool: lambda text: {'true': True, 'false': False}[text.lower()], int: read_integer,
    float: lambda text: float(read_number(text)), str: str}


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    return run_command(command_parser('param', 'Look at parameters, and set them.', (
        ('list', show_list, 'names of the parameters of a node, or of all',
         {'node': {'nargs': '?'}}),
        ('get', show_value, 'the value of a parameter', {'node': {}, 'parameter': {}}),
        ('set', set_value, 'give a parameter another value',
         {'node': {}, 'parameter': {}, 'value': {}}),
        ('describe', show_description, 'type, meaning and range of a parameter',
         {'node': {}, 'parameter': {}}))), argv)


def show_list(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the names of the parameters of one node, or of all, each below its node."""
    nodes = [_find_node(node, given)] if given.node else _nodes(node, given.timeout, bool, QUIET)
    for name in nodes:
        if not given.node:
            print(f'{name}:')
        for parameter in _parameter_names(node, name, given.timeout):
            print(f'  {parameter}')
    return 0


def show_value(node: GraphNode, given: argparse.Namespace) -> int:
    """Print the value of a parameter, as `ros2 param get` does."""
    name = _find_node(node, given)
    _describe(node, name, given)
    value, = call(node, GetParameters, f'{name}/get_parameters',
                  GetParameters.Request(names=[given.parameter]), given.timeout).values
    if value.type not in KINDS:
        print('Parameter not set.')
    else:
        print(f'{KINDS[value.type].sentence}: {parameter_value_to_python(value)}')
    return 0


def set_value(node: GraphNode, given: argparse.Namespace) -> int:
    """Set a parameter and print the result; raises GraphError if the node rejects it."""
    name = _find_node(node, given)
    value = value_of(given.parameter, _describe(node, name, given).type, given.value)
    result, = call(node, SetParameters, f'{name}/set_parameters', SetParameters.Request(
        parameters=[Parameter(name=given.parameter, value=value)]), given.timeout).results
    if result.successful:
        print('Set parameter successful')
        return 0
    raise GraphError(f'setting parameter failed: {result.reason}')


def show_description(node: GraphNode, given: argparse.Namespace) -> int:
    """Print type, description and constraints of a parameter, as `ros2 param describe` does."""
    described = _describe(node, _find_node(node, given), given)
    kind = KINDS[described.type].name if described.type in KINDS else 'not set'
    print(f'Parameter name: {described.name}\n  Type: {kind}')
    if described.description:
        print(f'  Description: {described.description}')
    print('  Constraints:')
    if described.read_only:
        print('    Read only: true')
    for span in (*described.floating_point_range, *described.integer_range):
        print(f'    Min value: {span.from_value}\n    Max value: {span.to_value}')
    if described.additional_constraints:
        print(f'    Additional constraints: {described.additional_constraints}')
    return 0


def value_of(name: str, kind: int, text: str) -> ParameterValue:
    """
    `ParameterValue` of a type, from a word of the command line.

    Unlike `ros2 param set`, it takes an integer for a double, and any text for a string.

    Raises
    ------
    GraphError: for a text that is not of that type.

    """
    wanted = KINDS.get(kind) or KINDS[ParameterType.PARAMETER_STRING]
    try:
        value = ([_element(each, wanted.type) for each in load_yaml(text).value]
                 if wanted.is_list else READERS[wanted.type](text))
        value_message = ParameterValue(type=kind, check_fields=True)
        setattr(value_message, wanted.field, value)
    except (AssertionError, KeyError, TypeError, ValueError, OverflowError):
        article = 'an' if wanted.name[0] in 'aeiou' else 'a'
        raise GraphError(f'parameter {name} must be {article} {wanted.name}, '
                         f'got {text!r}') from None
    return value_message


def _element(value: Any, kind: type) -> Any:
    if type(value) is not kind and not (kind is float and type(value) is int):
        raise TypeError
    return kind(value)


def _describe(node: GraphNode, name: str, given: argparse.Namespace) -> ParameterDescriptor:
    """
    Return the `ParameterDescriptor` of the given parameter of a node.

    Raises
    ------
    GraphError: if the node has no such parameter.

    """
    described, = call(node, DescribeParameters, f'{name}/describe_parameters',
                      DescribeParameters.Request(names=[given.parameter]),
                      given.timeout).descriptors or [None]
    if described is None or described.type not in KINDS and not described.description:
        raise GraphError(f'node {name!r} has no parameter {given.parameter!r}; it has '
                         f'{", ".join(_parameter_names(node, name, given.timeout))}')
    return described


def _parameter_names(node: GraphNode, name: str, timeout: float) -> list[str]:
    return sorted(call(node, ListParameters, f'{name}/list_parameters', ListParameters.Request(),
                       timeout).result.names)


def _find_node(node: GraphNode, given: argparse.Namespace) -> str:
    """Return the full name of the given node; raises GraphError if it is not in the graph."""
    name = full_name(given.node)
    found = _nodes(node, given.timeout, lambda seen: name in seen)
    if name not in found:
        raise GraphError(missing('node', name, found))
    return name


def _nodes(node: GraphNode, timeout: float, is_complete: Callable[[list[str]], object],
           quiet: float = 0.0) -> list[str]:
    """Return the full names of all nodes but hidden ones, such as this one."""
    def look() -> list[str]:
        return sorted({f'{namespace.rstrip("/")}/{name}' for name, namespace
                       in node.get_node_names_and_namespaces() if not name.startswith('_')})
    return settled(node, look, timeout, is_complete, quiet)


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
