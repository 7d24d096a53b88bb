# SPDX-License-Identifier: Apache-2.0
"""All topics and services: name, message type, the tuple with its fields, QoS, conversion."""

from collections.abc import Callable
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from comply_msgs import msg
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.topic_endpoint_info import TopicEndpointInfo

from comply_ros.mentor.several_mentors import MOST_MENTORS
from comply_ros.nodes import cdr
from comply_ros.protocol import messages
from comply_ros.protocol.mentor_topics import MENTORS, name_of_mentor
from comply_ros.protocol.world_description import LARGEST_DESCRIPTION

# One observation is open at a time, so only the newest message counts; late subscribers get it.
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
# With several mentors there is one for each.
OF_EACH_MENTOR = QoSProfile(depth=MOST_MENTORS, reliability=ReliabilityPolicy.RELIABLE,
                            durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Reports follow each other; late subscribers receive the last thousand.
REPORTED = QoSProfile(depth=messages.REPORTS, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Topic(NamedTuple):
    """
    A topic.

    Attributes
    ----------
    name: relative.
    message: the class of its messages.
    tuple_type: the tuple with the same fields but the header.
    qos: how it is published and subscribed to.
    raw: whether its messages are converted without rclpy, see `cdr`.

    """

    name: str
    message: type[Any]
    tuple_type: type[Any]
    qos: QoSProfile
    raw: bool = False


def _topic(name: str, qos: QoSProfile) -> Topic:
    tuple_type = messages.TOPIC_TYPES[name]
    message = getattr(msg, tuple_type.__name__)
    # rclpy converts the actions of all states at once, as an array.
    raw = tuple_type is not messages.Policy and cdr.layout(message) is not None
    return Topic(name, message, tuple_type, qos, raw)


WORLD = _topic('world', LATCHED)
STATE = _topic('state', LATCHED)
RECOMMENDATION = _topic('recommendation', LATCHED)
ACTION = _topic('action', LATCHED)
EPISODE = _topic('episode', REPORTED)
PROGRESS = _topic('progress', REPORTED)
TRUST = _topic('trust', OF_EACH_MENTOR)
POLICY = _topic('policy', LATCHED)
VALUES = _topic('values', LATCHED)
MENTOR_POLICY = _topic('mentor_policy', LATCHED)
DESCRIPTION = _topic('method', REPORTED)

# Of `gym_world`, a sensor_msgs/Image; only who draws or shows pictures loads that package.
IMAGE, IMAGE_QOS = 'image', QoSProfile(depth=1)

LOOP = (WORLD, STATE, RECOMMENDATION, ACTION)  # what a step of the run waits for

RECOMMEND = 'recommend'  # service of the mentor
SAVE = 'save'  # service of the learner
PAUSE, STEP = '~/pause', '~/step'  # services of the world
RESET = '~/reset'  # service of the world, and of the learner
UNKNOWN = '_UNKNOWN_'  # in the name of a node of which discovery only has an endpoint
ANOTHER = 'another learner is meant'  # how `save` answers a request for another learner


class MessageError(ValueError):
    """Bytes that are no message of a topic; the message names the topic, the rule and the size."""


def topic_of_mentor(topic: Topic, mentor: str) -> Topic:
    """Return a topic of a mentor, whose name may be empty."""
    return topic._replace(name=name_of_mentor(topic.name, mentor))


def mentors_found(node: Node) -> list[str]:
    """
    Return the names of the mentors that publish recommendations in the namespace of a node.

    The one without a name, '', comes first.
    """
    before, after = f'{node.resolve_topic_name(MENTORS)}/', f'/{RECOMMENDATION.name}'
    names = [topic[len(before):-len(after)] for topic, _ in node.get_topic_names_and_types()
             if topic.startswith(before) and topic.endswith(after)]
    return sorted(name for name in ('', *names) if '/' not in name and node.count_publishers(
        name_of_mentor(RECOMMENDATION.name, name)))


def new_mentors(node: Node, known: set[str]) -> list[str]:
    """Return the names that are found of mentors, and were not known; they are known then."""
    found = [name for name in mentors_found(node) if name and name not in known]
    found = found[:max(0, MOST_MENTORS - len(known))]
    known.update(found)
    return found


def reader(topic: Topic) -> Callable[[bytes], Any]:
    """
    Return a function from the bytes of a message to its tuple.

    That raises MessageError for other bytes, and for a world that is too large.
    """
    decode = cdr.decoder(topic.message, topic.tuple_type) if topic.raw else _slow_decoder(topic)
    describes = topic.tuple_type is messages.WorldDescription

    def read(content: bytes) -> Any:
        if describes:
            check_description_size(len(content))
        try:
            return decode(content)
        except Exception:  # noqa: BLE001 - of other bytes, whatever rclpy raises
            raise MessageError(
                f'a message on {topic.name} must be a {topic.message.__name__} of protocol '
                f'{messages.PROTOCOL}, got {len(content)} bytes that are none: is its publisher '
                'of another version of comply_ros?') from None
    return read


def writer(topic: Topic, clock: cdr.Clock) -> Callable[[Any], Any]:
    """
    Return a function from a tuple to what is published: bytes, or a message.

    clock: read for the stamp of each message.
    """
    if topic.raw:
        return cdr.encoder(topic.message, clock)
    fill = encoder(topic)

    def write(values: Any) -> Any:
        message = fill(values)
        message.header.stamp = time_message(clock())
        return message
    return write


def check_description_size(size: int) -> None:
    """Return if a description of a world may have so many bytes; raises MessageError."""
    if size > LARGEST_DESCRIPTION:
        raise MessageError('the description of a world must have at most '
                           f'{LARGEST_DESCRIPTION // 2 ** 20} MiB, got {size / 2 ** 20:.1f} MiB')


def description_size(description: messages.WorldDescription) -> int:
    """Return the bytes of the description of a world as a message."""
    return len(serialize_message(encoder(WORLD)(description)))


def decoder(topic: Topic) -> Callable[[Any], Any]:
    """Return a function from a message to its tuple."""
    return messages.tuple_maker(topic.tuple_type)


def encoder(topic: Topic) -> Callable[[Any], Any]:
    """
    Return a function from a tuple to its message: always the same object, filled anew.

    The header of the message stays as it is.
    """
    message = topic.message()
    return lambda values: _fill(message, values)


def _slow_decoder(topic: Topic) -> Callable[[bytes], Any]:
    decode = decoder(topic)
    return lambda content: decode(deserialize_message(content, topic.message))


def _fill(message: Any, values: Any) -> Any:
    """Change the fields of a message to those of a tuple; return the message."""
    for name, value in zip(values._fields, values):
        field = getattr(message, name)
        if isinstance(field, Time):
            setattr(message, name, time_message(value))
        elif hasattr(value, '_fields'):
            _fill(field, value)
        else:
            setattr(message, name, value)
    return message


def time_message(nanoseconds: int) -> Time:
    """Return a time as messages have it; nanoseconds: since 1970."""
    seconds, rest = divmod(nanoseconds, messages.NANOSECONDS)
    return Time(sec=seconds, nanosec=rest)


def node_name(end: TopicEndpointInfo) -> str:
    """Return the full name of the node of a publisher or subscriber."""
    return f'{end.node_namespace.rstrip("/")}/{end.node_name}'


def publisher_names(node: Node, topic: Topic) -> list[str]:
    """Return the full names of the nodes that publish on a topic, as `node` knows them now."""
    names = {node_name(end) for end in node.get_publishers_info_by_topic(topic.name)}
    return sorted(name for name in names if UNKNOWN not in name)  # it is found a moment later
