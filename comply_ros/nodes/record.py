# SPDX-License-Identifier: Apache-2.0
"""`record`: a node that writes the conversation to an MCAP bag."""

from pathlib import Path
import time

from ament_index_python import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from comply_ros.bags.bag_writer import BagWriter, latched
from comply_ros.nodes import topics
from comply_ros.nodes.diagnostics import TOPIC as DIAGNOSTICS
from comply_ros.nodes.parameters import (
    BAG,
    declare,
    ParameterError,
    SafeParameterNode,
    unknown_overrides,
)
from comply_ros.nodes.spin import run_node
from comply_ros.storage.file_system import printable

TOPICS = tuple(each for each in vars(topics).values() if isinstance(each, topics.Topic))
DEPTH = 10_000  # messages of a topic that may wait to be written: four seconds at full speed
TELL = 5.0  # seconds between two words on how many there are
FLUSH = 1.0  # seconds after which what was heard is in the file, should the recorder be killed
BUILTIN = ('builtin_interfaces', 'std_msgs', 'diagnostic_msgs', 'comply_msgs')


class RecordError(RuntimeError):
    """A bag that cannot be written; the message names it and the reason."""


class RecordNode(SafeParameterNode):
    """
    Writes all that is said, as it comes over the wire, without looking into it.

    Attributes
    ----------
    mistake: an exception that a callback found; it ends the node.

    """

    def __init__(self, **kwargs):
        super().__init__('record', **kwargs)
        self.mistake, self._told = None, 0
        self._path = new_path(declare(self, BAG))
        try:
            self._bag = BagWriter(self._path, definitions())
        except OSError as error:
            raise RecordError(self._words(error)) from None
        for topic in TOPICS:
            self._record(topic.message, topic.name, QoSProfile(
                depth=DEPTH, reliability=ReliabilityPolicy.RELIABLE,
                durability=DurabilityPolicy.TRANSIENT_LOCAL), (latched(topic.qos.depth),))
        self._record(DiagnosticArray, DIAGNOSTICS, QoSProfile(depth=DEPTH), ())
        self.create_timer(FLUSH, self._flush)
        self.create_timer(TELL, self._tell)
        for unknown in unknown_overrides(self):
            self.get_logger().warning(f'parameter {unknown!r} is unknown and has no effect')
        self.get_logger().info(f'records to {printable(self._path)}')

    def leave(self):
        """Write the end of the bag: the node ends."""
        try:
            self._bag.close()
        except OSError as error:
            raise RecordError(self._words(error)) from None
        counts = ', '.join(f'{name} {count:,}'
                           for name, count in self._bag.counts.items() if count)
        self.get_logger().info(f'wrote {self._count():,} messages to {printable(self._path)} '
                               f'({counts or "nobody spoke"})')

    def _record(self, message, name, qos, offered):
        name = self.resolve_topic_name(name)
        package = message.__module__.partition('.')[0]
        self._bag.add(name, f'{package}/msg/{message.__name__}', offered)
        write, counts = self._bag.write, self._bag.counts

        def take(content):
            try:
                write(name, time.time_ns(), content)
                if counts[name] == 1:
                    self.get_logger().info(f'hears {name}')
            except OSError as error:
                self.mistake = RecordError(self._words(error))
        self.create_subscription(message, name, take, qos, raw=True)

    def _flush(self):
        try:
            self._bag.flush()
        except OSError as error:
            self.mistake = RecordError(self._words(error))

    def _tell(self):
        if self._count() != self._told:
            self._told = self._count()
            self.get_logger().info(f'{self._told:,} messages')

    def _count(self):
        return sum(self._bag.counts.values())

    def _words(self, error):
        return (f'bag {printable(self._path)!r} cannot be written '
                f'({(error.strerror or str(error)).lower()})')


def new_path(text):
    """
    Return the path of a new bag; for an empty text one that is named after the time.

    Raises
    ------
    ParameterError: if something is there already.

    """
    path = Path(text or time.strftime('runs/bag-%Y-%m-%d-%H-%M-%S')).expanduser()
    if path.exists():
        raise ParameterError('parameter bag must be a folder that is not there yet, '
                             f'got {str(path)!r}')
    return path


def definitions():
    """Return the text of each message type that may be needed, as it is installed."""
    found = {}
    for package in BUILTIN:
        folder = Path(get_package_share_directory(package)) / 'msg'
        found.update({f'{package}/msg/{path.stem}': path.read_text()
                      for path in folder.glob('*.msg')})
    return found


def main(argv):
    """Run the node; return the exit code."""
    return run_node(RecordNode, argv, (ParameterError, RecordError))
