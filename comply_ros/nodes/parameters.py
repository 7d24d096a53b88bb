# SPDX-License-Identifier: Apache-2.0
"""The parameters of all nodes in one table: names, defaults, descriptions and valid values."""

from dataclasses import fields
from typing import Any, NamedTuple

from comply_ros.learner.learner_config import CONFIG_FIELDS, LearnerConfig
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.advice_budget import ADVISING_MODES, UNLIMITED
from comply_ros.mentor.several_mentors import can_be_mentors
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.protocol.channel_faults import Faults
from comply_ros.storage.map_name import OTHER_MAPS
from comply_ros.storage.state_numbers import BINS as DEFAULT_BINS


class ParameterError(ValueError):
    """A parameter with an invalid value; the message names it, the rule and the value."""


class Parameter(NamedTuple):
    """One parameter of a node: name, default, description, and which values are valid."""

    name: str
    default: Any
    description: str
    range: tuple[float, float] | None = None
    choices: tuple[str, ...] | None = None
    read_only: bool = True  # else it may be set while the node runs


def config_parameters(config: LearnerConfig) -> list[Parameter]:
    """Parameters of the learner for every field of `LearnerConfig`; defaults from `config`."""
    return [_from_metadata(name, getattr(config, name), field.metadata, read_only=False)
            for name, field in CONFIG_FIELDS.items()]


def _from_metadata(name, default, metadata, read_only):
    low, high = metadata['low'], metadata['high']
    return Parameter(name, default, metadata['text'], None if low is None else (low, high),
                     metadata.get('choices'), read_only)


MAP = Parameter('map', 'maze', f'Name of a map of this package, {OTHER_MAPS}')
ENV = Parameter('env', '', 'Name of an environment of Gymnasium, such as MountainCar-v0')
ENV_ARGS = Parameter(
    'env_args', '{}', "Arguments of the environment as a table, such as '{is_slippery: false}'")
MODULE = Parameter(
    'module', '', 'Module of your own to import first, which registers the environment')
BINS = Parameter(
    'bins', [DEFAULT_BINS], 'Of a Box of observations: number of intervals in each dimension, of '
    'a Tuple in those of all its Boxes; one number is for all of them')
LIMITS = Parameter(
    'limits', '', "LOW,HIGH of the same dimensions, with ';' between two; empty: those of the "
    'environment')
USE_TABLE = Parameter(
    'use_table', True, 'Describe the world by the table of transitions (P) of the environment, '
    'where it has one; false: without a model')
IMAGE_RATE = Parameter(
    'image_rate', 5.0, 'Pictures per second at most, on the topic image, if the environment has '
    'the render mode rgb_array and while somebody subscribes; never more than 2 % of the time is '
    'spent on them; 0: none', (0, 60))
PROFILE = Parameter(
    'profile', 'published', 'Settings of the text of the report, or of the runs behind its '
    'figures', choices=tuple(METHODS))
SEED = Parameter('seed', 0, 'Seed of the random numbers', (0, SEED_LIMIT))
SLOWEST, FASTEST = 0.001, 1000  # steps per second that a world can be slowed down to
RATE = Parameter(
    'rate', 0.0, 'Steps per second; 0: as fast as possible', (0, FASTEST), read_only=False)
METHOD = Parameter(
    'method', 'beta_implicit', 'Learning method; sets the defaults of the parameters below',
    choices=tuple(METHODS['published']))
MENTOR = Parameter(
    'mentor', 'snapshot:0.75', 'optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, '
    'learned:FILE.npz (what a learner has learned and saved), learner:/NAMESPACE (the newest '
    'policy of another learner, which runs) or none; with @C behind it, advice in a share C of '
    'the states only')
MENTOR_NAME = Parameter(
    'name', '', 'Name of this mentor, where a learner has several: it publishes on '
    'mentors/NAME/recommendation; empty: the only one, on recommendation')
ROBOTS = Parameter(
    'robots', [''], 'Namespaces of other robots, such as /robot_2, that this process teaches too: '
    'a node in each, by the same policy, each with a budget of its own; an empty one is none')
MENTORS = Parameter(
    'mentors', [''], 'Names of the mentors that the learner waits for in every state; an empty '
    'one publishes on recommendation. Others that it finds join at the next episode, and are '
    'waited for as long as they answer')
BUDGET = Parameter(
    'budget', UNLIMITED, 'Recommendations that the mentor may give; 0: no limit',
    (0, 1_000_000_000))
ADVISING = Parameter(
    'advising', 'early', 'With a budget, when the mentor spends it: in the first states, where '
    'much depends on the action, or where the learner did something else the last time (then the '
    'learner needs remembers_advice false)', choices=ADVISING_MODES)
MENTOR_SEED = Parameter('seed', 0, 'Which one of the mentors of this kind', (0, SEED_LIMIT))
MAP_PERIOD = Parameter(
    'map_period', 1.0, 'Seconds between two maps over all states, at least; never less than 60 '
    'times what the last ones took', (0, 3600))
REMEMBERS_ADVICE = Parameter(
    'remembers_advice', True, 'In a state with earlier advice, act on it at once; newer advice '
    'there counts from the next visit on', read_only=False)
ADVICE_TIMEOUT = Parameter(
    'advice_timeout', 0.0, 'Seconds to wait for advice in a state before going on without it; 0: '
    'no limit', (0, 3600), read_only=False)
OWN_ADVICE_TIMEOUT = Parameter(
    'NAME.advice_timeout', 0.0, 'Seconds to wait for the advice of the mentor NAME; 0: '
    'advice_timeout', (0, 3600), read_only=False)
PATIENCE = Parameter(
    'patience', 1.0, 'While a person steers: seconds that an observation waits for the person, '
    'before the recommendation is no advice', (0.05, 3600), read_only=False)
POLICY_FILE = Parameter(
    'policy_file', 'policy.txt', 'File to which a human mentor saves the policy')
INITIAL_LEARNING = Parameter(
    'initial_learning', '', 'File that a learner has saved (learning.npz), of the same world: '
    'begin with its values and beliefs. It is no checkpoint: schedules, counts and random numbers '
    'begin anew. A checkpoint in state_dir counts more; empty: begin with nothing')
END_WHEN_FINISHED = Parameter(
    'end_when_finished', False, 'Whether the learner ends, with exit code 0, when it has learned '
    'its last iteration; else it stays, and what it learned can be asked for and saved')
STATE_DIR = Parameter(
    'state_dir', '', 'Folder for the checkpoint and journal with which the node goes on after a '
    'kill as if nothing had happened; empty: nothing is stored')
BAG = Parameter(
    'bag', '', 'Folder of the bag to write, which must not exist yet; empty: named after the '
    'time, in runs/')
RECORDED = Parameter(
    'topics', ['view/*'], 'Topics to record besides those of the conversation: names, or patterns '
    'such as view/*')
TOPICS = Parameter(
    'topics', ['state', 'recommendation', 'action'], 'Topics to relay: messages on NAME/before '
    'are published on NAME; a part of a name may be *, as in mentors/*/recommendation, for all '
    'that are found')
DEPTH = Parameter(
    'depth', 1, 'Messages of a latched topic that late subscribers receive: the depth of the '
    'relayed publisher, which discovery does not tell', (1, 100_000))
FRAME = Parameter('frame', 'map', 'Coordinate frame of everything that the viewer publishes')
ROBOT_FRAME = Parameter(
    'robot_frame', 'robot', 'Coordinate frame of the robot, published on /tf where tf2_msgs is '
    'installed; empty: not published')
CELL_SIZE = Parameter(
    'cell_size', 1.0, 'Side of a cell, in metres, where states have no positions', (0.001, 1000))
ROBOT_RATE = Parameter(
    'robot_rate', 10.0, 'How often per second robot, trail and returns are published, if they '
    'changed', (0.01, 100))
MAP_RATE = Parameter(
    'map_rate', 1.0, 'How often per second maps and arrows are published, if they changed',
    (0.01, 100))
TRAIL_LENGTH = Parameter(
    'trail_length', 1000, 'Points of the trail of an episode, at most', (1, 100_000))
ADDRESS = Parameter(
    'address', 'localhost', 'Address that the page is served on; one that other machines reach, '
    'such as 0.0.0.0, requires the token')
PORT = Parameter('port', 8080, 'Port that the page is served on; 0: any free one', (0, 65535))
TOKEN_FILE = Parameter(
    'token_file', '', 'File, of mode 600, with the token that a browser has to present before it '
    'sees the page; it is created if it does not exist. The environment variable COMPLY_ROS_TOKEN '
    'counts more. Empty: no token on localhost, elsewhere one is made and printed on the terminal')
TEACH = Parameter(
    'teach', 'auto', 'Whether a person teaches on the page, as the node mentor: true, false (the '
    'page only watches) or auto (it watches while another mentor is heard, and offers to take '
    'over, or to teach too where mentors have names)', choices=('auto', 'true', 'false'))
PERSON_NAME = MENTOR_NAME._replace(
    description='Name of the person who teaches, as of any mentor: it publishes on '
    'mentors/NAME/recommendation; empty: on recommendation, and beside mentors with names person, '
    'or person_2 and so on where that is taken')
FAULTS = tuple(_from_metadata(field.name, field.default, field.metadata, read_only=True)
               for field in fields(Faults))
ROS_PARAMETERS = (  # of every node, declared by rclpy
    Parameter('use_sim_time', False, 'Follow the topic /clock', read_only=False),
    Parameter('start_type_description_service', True, 'Serve the definitions of types'))
KNOWN_NAMES = {each.name for each in (*globals().values(), *FAULTS, *ROS_PARAMETERS)
               if isinstance(each, Parameter)} | set(CONFIG_FIELDS)


def timeout_of(mentor: str) -> Parameter:
    """Return the parameter for how long a learner waits for a mentor, which has a name."""
    name = OWN_ADVICE_TIMEOUT.name.replace('NAME', mentor)
    return OWN_ADVICE_TIMEOUT._replace(
        name=name, description=OWN_ADVICE_TIMEOUT.description.replace('NAME', mentor))


def mentor_of_timeout(name: str) -> str | None:
    """Return the mentor whose timeout a parameter of this name is; None where it is another."""
    mentor, _, last = name.rpartition('.')
    return mentor if last == ADVICE_TIMEOUT.name and mentor and can_be_mentors([mentor]) else None
