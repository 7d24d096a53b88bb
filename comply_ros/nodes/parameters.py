# SPDX-License-Identifier: Apache-2.0
"""Parameters with descriptors, declared from what core knows of them."""

from dataclasses import fields
from typing import NamedTuple

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.advice_budget import ADVISING_MODES, UNLIMITED
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.protocol.channel_faults import Faults


class ParameterError(ValueError):
    """A parameter that cannot be; the message names it, the rule and the value."""


class Parameter(NamedTuple):
    """One parameter of a node: its name, default and meaning, and what it may be."""

    name: str
    default: object
    text: str
    low: float = None
    high: float = None
    choices: tuple = None
    changes: bool = False  # whether it may change while the node runs


def field_parameters(method):
    """Parameters of the learner for every field of `LearnerConfig`, with that row's values."""
    return [Parameter(name, getattr(method, name), row.metadata['text'], row.metadata['low'],
                      row.metadata['high'], row.metadata.get('choices'), changes=True)
            for name, row in CONFIG_FIELDS.items()]


MAP = Parameter('map', 'maze', 'Name of a map that comes with the package, or a file')
PROFILE = Parameter(
    'profile', 'published', 'Settings of the text of the report, or of the runs behind its '
    'figures', choices=tuple(METHODS))
SEED = Parameter('seed', 0, 'Seed of the random numbers', 0, SEED_LIMIT)
SLOWEST, FASTEST = 0.001, 1000  # steps per second that a world can be slowed down to
RATE = Parameter(
    'rate', 0.0, 'Steps per second; 0: as fast as the loop goes', 0, FASTEST, changes=True)
METHOD = Parameter(
    'method', 'beta_implicit', 'How to learn; sets the defaults of the parameters below',
    choices=tuple(METHODS['published']))
MENTOR = Parameter(
    'mentor', 'snapshot:0.75', 'optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH '
    'or none; with @C behind it, in a share C of the states only')
BUDGET = Parameter(
    'budget', UNLIMITED, 'Recommendations that the mentor has to give; 0: no limit', 0,
    1_000_000_000)
ADVISING = Parameter(
    'advising', 'early', 'With a budget, when it gives one: in the first states, where much '
    'depends on it, or where the learner did something else the last time (then the learner '
    'needs remembers_advice false)', choices=ADVISING_MODES)
MENTOR_SEED = Parameter(
    'seed', 0, 'Which one of the mentors of this kind', 0, SEED_LIMIT)
MAP_PERIOD = Parameter(
    'map_period', 1.0, 'Least time between two maps over all states, in seconds; at least 60 '
    'times as long as the last ones took', 0, 3600)
REMEMBERS_ADVICE = Parameter(
    'remembers_advice', True, 'In a state in which the mentor has spoken before, act at once on '
    'what it said then; what it says now counts from the next visit on', changes=True)
ADVICE_TIMEOUT = Parameter(
    'advice_timeout', 0.0, 'Seconds of silence, in each state, after which the mentor counts as '
    'having no advice there; 0: it is waited for', 0, 3600, changes=True)
PATIENCE = Parameter(
    'patience', 1.0, 'While a person steers: seconds that a question waits for the person, before '
    'the answer is no advice', 0.05, 3600, changes=True)
POLICY_FILE = Parameter(
    'policy_file', 'policy.txt', 'File to which the policy of a person is saved')
STATE_DIR = Parameter(
    'state_dir', '', 'Folder in which the node keeps what it needs to go on after a kill as if '
    'nothing had happened; empty: nothing is kept')
BAG = Parameter(
    'bag', '', 'Folder of the bag to write, which must not be there yet; empty: named after the '
    'time, in runs/')
TOPICS = Parameter(
    'topics', ['state', 'recommendation', 'action'], 'Topics to relay: what is heard on '
    'NAME/before is said on NAME')
KEPT = Parameter(
    'depth', 1, 'Messages that a latched topic keeps for who comes late: the depth of the '
    'publisher that is relayed, which the graph does not tell', 1, 100_000)
FRAME = Parameter('frame', 'map', 'Coordinate frame of all that the viewer publishes')
CELL_SIZE = Parameter('cell_size', 1.0, 'Side of a cell, in metres', 0.001, 1000)
ROBOT_RATE = Parameter(
    'robot_rate', 10.0, 'How often a second robot, trail and returns are shown, if they changed',
    0.01, 100)
MAP_RATE = Parameter(
    'map_rate', 1.0, 'How often a second maps and arrows are shown, if they changed', 0.01, 100)
TRAIL_LENGTH = Parameter(
    'trail_length', 1000, 'Points of the trail of an episode, at most', 1, 100_000)
ADDRESS = Parameter(
    'address', 'localhost', 'Address that the page is served on; one that other machines reach, '
    'such as 0.0.0.0, asks for the token')
PORT = Parameter('port', 8080, 'Port that the page is served on; 0: any free one', 0, 65535)
TOKEN = Parameter(
    'token', '', 'What a page has to know before it sees anything; empty: none is asked for on '
    'localhost, elsewhere one is made and printed')
TEACH = Parameter(
    'teach', True, 'Whether a person teaches on the page, as the node mentor; false: the page '
    'only watches')
FAULTS = tuple(Parameter(each.name, each.default, **each.metadata) for each in fields(Faults))

OURS = (MAP, PROFILE, SEED, RATE, METHOD, MENTOR, BUDGET, ADVISING, MAP_PERIOD,
        REMEMBERS_ADVICE, ADVICE_TIMEOUT, PATIENCE, POLICY_FILE, STATE_DIR, BAG, TOPICS, KEPT,
        FRAME, CELL_SIZE, ROBOT_RATE, MAP_RATE, TRAIL_LENGTH, ADDRESS, PORT, TOKEN,
        TEACH, *FAULTS)
ROS = {'use_sim_time', 'start_type_description_service'}


class SafeParameterNode(Node):
    """A node that lives on when its parameters are set to a type that there is not."""

    def create_service(self, kind, name, reply, **settings):
        """Make a service; those that set parameters refuse what rclpy ends the node for."""
        refuse = {SetParameters: _refuse_each, SetParametersAtomically: _refuse_all}.get(kind)

        def answer(request, response):
            problem = _problem_of_types(request.parameters)
            return refuse(request, response, problem) if problem else reply(request, response)
        return super().create_service(kind, name, answer if refuse else reply, **settings)


def _problem_of_types(parameters):
    known = {kind.value for kind in RosParameter.Type}
    for parameter in parameters:
        if parameter.value.type not in known:
            return SetParametersResult(
                successful=False, reason='the type of a parameter must be one of '
                f'{min(known)} to {max(known)}, got {parameter.value.type}')
    return None


def _refuse_each(request, response, problem):
    response.results = [problem] * len(request.parameters)
    return response


def _refuse_all(request, response, problem):
    response.result = problem
    return response


def declare(node, parameter):
    """
    Declare a parameter and return its value.

    Raises
    ------
    ParameterError: for a value of another type, out of range, or not among the choices.

    """
    try:
        value = node.declare_parameter(parameter.name, parameter.default,
                                       descriptor(parameter)).value
    except (InvalidParameterTypeException, InvalidParameterValueException) as error:
        raise ParameterError(_sentence(node, parameter, error)) from None
    if value is None:  # rclpy takes the empty list of a file for no value, and no default either
        raise ParameterError(_sentence(node, parameter, '[]'))
    if parameter.choices and value not in parameter.choices:
        raise ParameterError(f'parameter {parameter.name} must be one of '
                             f'{", ".join(parameter.choices)}, got {value!r}')
    return value


def sets(node, change, check=lambda values: None):
    """
    Have parameters of a node change while it runs.

    change: called with a table of the new values by name, when they are set.
    check: called with such a table before, of values of the right type and range; raises
        ValueError, with a sentence, to refuse it.

    """
    def refuse(parameters):
        try:
            check({each.name: each.value for each in parameters})
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)
    node.add_on_set_parameters_callback(refuse)
    node.add_post_set_parameters_callback(
        lambda parameters: change({each.name: each.value for each in parameters}))


def descriptor(parameter):
    """`ParameterDescriptor` with description and range."""
    described = ParameterDescriptor(description=parameter.text, read_only=not parameter.changes)
    if parameter.choices:
        described.additional_constraints = 'one of ' + ', '.join(parameter.choices)
    if parameter.low is not None and type(parameter.default) is float:
        described.floating_point_range = [FloatingPointRange(
            from_value=float(parameter.low), to_value=float(parameter.high))]
    if parameter.low is not None and type(parameter.default) is int:
        described.integer_range = [IntegerRange(
            from_value=int(parameter.low), to_value=int(parameter.high))]
    return described


def unknown_overrides(node):
    """Names that were given a value, on the command line or in a file, but mean nothing here."""
    given = getattr(node, '_parameter_overrides', {})
    ours = {parameter.name for parameter in OURS} | set(CONFIG_FIELDS) | ROS
    return [name for name in given
            if name not in ours and ('.' not in name or name.partition('.')[0] in ours)]


def _sentence(node, parameter, error):
    given = getattr(node, '_parameter_overrides', {}).get(parameter.name)
    value = error if given is None or given.value is None else repr(given.value)
    if isinstance(error, InvalidParameterValueException):
        return (f'parameter {parameter.name} must lie in [{parameter.low}, {parameter.high}], '
                f'got {value}')
    kind = {bool: 'true or false', int: 'an integer such as 1', str: 'a string',
            float: 'a double such as 1.0 (with a point)',
            list: 'a list of strings such as [state, action]'}[type(parameter.default)]
    return f'parameter {parameter.name} must be {kind}, got {value}'
