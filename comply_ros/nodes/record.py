# SPDX-License-Identifier: Apache-2.0
"""`record`: a node that writes all messages of a lesson to an MCAP bag."""

from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path
import re
import time
from typing import Any

from ament_index_python import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from comply_ros.bags.bag_writer import BagWriter, latched
from comply_ros.nodes import topics
from comply_ros.nodes.clocks import steady_timer
from comply_ros.nodes.diagnostics import TOPIC as DIAGNOSTICS
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.parameters import BAG, ParameterError, RECORDED
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topic_type_check import type_name
from comply_ros.protocol.mentor_topics import name_of_mentor, TOPICS_OF_MENTORS
from comply_ros.storage.file_system import printable, reason_of

TOPICS = tuple(each for each in vars(topics).values() if isinstance(each, topics.Topic))
DEPTH = 10_000  # messages of a topic that may wait to be written: four seconds at full speed
COUNT_PERIOD = 5.0  # seconds between two log lines with the number of messages
DISCOVERY_PERIOD = 0.5  # seconds between two searches for the topics of the parameter
FLUSH_PERIOD = 1.0  # seconds after which a message is in the file, should the recorder be killed
PACKAGES = ('builtin_interfaces', 'std_msgs', 'diagnostic_msgs', 'comply_msgs')


class RecordError(RuntimeError):
    """A bag that cannot be written; the message names it and the reason."""


class RecordNode(SafeParameterNode):
    """Writes every message as it comes over the wire; `mistake` is an error, and ends the node."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('record', **kwargs)
        self.mistake: Exception | None = None
        self._logged_count = 0
        self._path = new_path(self.declare(BAG))
        try:
            self._bag = BagWriter(self._path, message_definitions())
        except OSError as error:
            raise self._error(error) from None
        for topic in TOPICS:
            self._record(topic.message, topic.name, QoSProfile(
                depth=DEPTH, reliability=ReliabilityPolicy.RELIABLE,
                durability=DurabilityPolicy.TRANSIENT_LOCAL), (latched(topic.qos.depth),))
        self._record(DiagnosticArray, DIAGNOSTICS, QoSProfile(depth=DEPTH), ())
        of_mentors = [name_of_mentor(name, '*') for name in TOPICS_OF_MENTORS]
        self._patterns = [self._absolute(each)
                          for each in (*of_mentors, *self.declare(RECORDED))]
        self._unknown: set[str] = set()  # topics of types that are not installed here
        self._find_topics()
        steady_timer(self, DISCOVERY_PERIOD, self._find_topics)
        steady_timer(self, FLUSH_PERIOD, self._flush)
        steady_timer(self, COUNT_PERIOD, self._log_count)
        self.get_logger().info(f'records to {printable(self._path)}')

    def leave(self) -> None:
        """Write the end of the bag: the node ends."""
        try:
            self._bag.close()
        except OSError as error:
            raise self._error(error) from None
        counts = ', '.join(f'{name} {count:,}'
                           for name, count in self._bag.counts.items() if count)
        self.get_logger().info(f'wrote {self._count():,} messages to {printable(self._path)} '
                               f'({counts or "no topic had any"})')

    def _record(self, message: type, name: str, qos: QoSProfile, offered: tuple) -> None:
        name = self.resolve_topic_name(name)
        self._bag.add(name, type_name(message), offered)
        write, counts = self._bag.write, self._bag.counts

        def receive(content: Any) -> None:
            try:
                write(name, time.time_ns(), content)
                if counts[name] == 1:
                    self.get_logger().info(f'receives {name}')
            except OSError as error:
                self.mistake = self._error(error)
        self.create_subscription(message, name, receive, qos, raw=True)

    def _find_topics(self) -> None:
        """Record the topics of mentors, and those of the parameter, that have a publisher now."""
        for name, types in self.get_topic_names_and_types():
            if name in self._bag.counts or name in self._unknown or not any(
                    fnmatchcase(name, pattern) for pattern in self._patterns):
                continue
            offers = [each.qos_profile for each in self.get_publishers_info_by_topic(name)]
            if offers:
                self._record_found(name, types[0], offers)

    def _record_found(self, name: str, message_type: str, offers: list[QoSProfile]) -> None:
        """Record a topic of any type, with a QoS that its publishers can serve."""
        package, _, message = message_type.split('/')
        try:
            message_class = getattr(import_module(f'{package}.msg'), message)
            self._bag.define(definitions_of(message_type))
        except (ImportError, AttributeError, LookupError, OSError):
            self._unknown.add(name)
            self.get_logger().warning(f'does not record {name}: its type {message_type} is not '
                                      'installed here')
            return
        is_latched = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offers)
        is_reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
        self._record(message_class, name, QoSProfile(
            depth=DEPTH,
            reliability=ReliabilityPolicy.RELIABLE if is_reliable else
            ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else
            DurabilityPolicy.VOLATILE), (latched(1),) if is_latched else ())

    def _absolute(self, pattern: str) -> str:
        """Return a pattern of topics as the graph has names."""
        return pattern if pattern.startswith('/') else \
            f'{self.get_namespace().rstrip("/")}/{pattern}'

    def _flush(self) -> None:
        try:
            self._bag.flush()
        except OSError as error:
            self.mistake = self._error(error)

    def _log_count(self) -> None:
        if self._count() != self._logged_count:
            self._logged_count = self._count()
            self.get_logger().info(f'{self._logged_count:,} messages')

    def _count(self) -> int:
        return sum(self._bag.counts.values())

    def _error(self, error: OSError) -> RecordError:
        return RecordError(f'bag {printable(self._path)!r} cannot be written '
                           f'({reason_of(error)})')


def new_path(name: str) -> Path:
    """Return the path of a new bag, named after the time by default; raises ParameterError."""
    path = Path(name or time.strftime('runs/bag-%Y-%m-%d-%H-%M-%S')).expanduser()
    if path.exists():
        raise ParameterError('parameter bag must be a folder that does not exist yet, '
                             f'got {str(path)!r}')
    return path


def message_definitions() -> dict[str, str]:
    """Return the text of each message type of `PACKAGES`, as it is installed."""
    return {f'{package}/msg/{path.stem}': path.read_text() for package in PACKAGES
            for path in (Path(get_package_share_directory(package)) / 'msg').glob('*.msg')}


def definitions_of(message_type: str) -> dict[str, str]:
    """
    Return the text of a message type and of all types in it, by their names.

    Raises PackageNotFoundError (a LookupError) or OSError if one is not installed.
    """
    definitions: dict[str, str] = {}
    missing = {message_type}
    while missing:
        name = missing.pop()
        package, _, message = name.split('/')
        path = Path(get_package_share_directory(package)) / 'msg' / f'{message}.msg'
        definitions[name] = path.read_text(encoding='utf-8')
        missing |= nested_types(definitions[name], package) - definitions.keys()
    return definitions


def nested_types(text: str, package: str) -> set[str]:
    """Return the message types that the definition of a message in a package refers to."""
    found = re.findall(r'(?m)^\s*(?:([a-z]\w*)/)?(?:msg/)?([A-Z]\w*)(?:\[[^]]*\])?\s+[a-z]', text)
    return {f'{other or package}/msg/{name}' for other, name in found}


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(RecordNode, argv, (ParameterError, RecordError))
