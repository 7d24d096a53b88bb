# SPDX-License-Identifier: Apache-2.0
"""The command `check`: whether a live world, mentor or learner follows the protocol."""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
import sys
import time
from typing import Any
import xml.etree.ElementTree as ElementTree

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from std_srvs.srv import Trigger

from comply_ros.nodes.external_node import FIND_TIME, full_name, PARTS, publisher_names
from comply_ros.nodes.ros_start import RosStartError, start_rclpy
from comply_ros.nodes.topics import (
    ACTION,
    decoder,
    DESCRIPTION,
    encoder,
    EPISODE,
    MENTOR_POLICY,
    RECOMMENDATION,
    STATE,
    Topic,
    WORLD,
)
from comply_ros.protocol import check_learner, check_mentor, check_world
from comply_ros.protocol.rule_report import (
    breaks_a_must,
    FAIL,
    NOT_REACHED,
    PASS,
    Received,
    SHOULD,
    summary,
    Verdict,
)
from comply_ros.storage.map_files import read_map
from comply_ros.storage.map_name import map_names, OTHER_MAPS
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.world.grid import MapError

ROS_ARGUMENTS = '--ros-args'
STATUS_TIME = 2.5  # seconds in which it must publish its status
COMMON_RULES = {
    'P1': 'publishers are reliable and transient local',
    'P12': 'the status is published on /diagnostics'}
# Of each kind of node: what it publishes, what the check publishes, and the rules.
RECEIVED: dict[str, tuple[Topic, ...]] = {
    'world': (STATE, WORLD, EPISODE), 'mentor': (RECOMMENDATION, MENTOR_POLICY),
    'learner': (ACTION, DESCRIPTION)}
SENT: dict[str, tuple[Topic, ...]] = {
    'world': (ACTION, WORLD), 'mentor': (WORLD, STATE, ACTION),
    'learner': (WORLD, STATE, RECOMMENDATION)}
RULES: dict[str, Mapping[str, str]] = {
    'world': check_world.RULES, 'mentor': check_mentor.RULES, 'learner': check_learner.RULES}


class NoNodeError(RuntimeError):
    """There is not one node to check; the message names those that there are."""


class RosChannel:
    """
    The `Channel` to one node, over the topics of this namespace.

    kind: of the node: `world`, `mentor` or `learner`.
    """

    def __init__(self, node: Node, kind: str) -> None:
        self._node, self._kind, self._name = node, kind, ''
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self.received: dict[str, list[Received]] = defaultdict(list)
        self.statuses: set[str] = set()
        self._publishers = {
            topic.tuple_type.__name__: (node.create_publisher(topic.message, topic.name,
                                                              topic.qos), encoder(topic))
            for topic in SENT[kind]}
        self._sent_worlds: set[int] = set()
        for topic in RECEIVED[kind]:
            self._listen(topic)
        node.create_subscription(DiagnosticArray, '/diagnostics', lambda msg: self.statuses.update(
            status.name for status in msg.status), 10)

    def send(self, message: Any) -> None:
        """Publish a message."""
        publisher, fill = self._publishers[type(message).__name__]
        if hasattr(message, 'protocol'):
            self._sent_worlds.add(message.run)
        publisher.publish(fill(message))

    def wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Spin until a condition is true, at most so many seconds; return whether it is."""
        end = time.monotonic() + seconds
        while not condition():
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            self._executor.spin_once(timeout_sec=min(left, 0.05))
        return True

    def reset(self) -> bool:
        """Call the service `reset` of the node, if it has one."""
        client = self._node.create_client(Trigger, f'{self._name}/reset')
        try:
            if not self.wait(client.service_is_ready, 1.0):
                return False
            future = client.call_async(Trigger.Request())
            return self.wait(future.done, FIND_TIME) and future.result().success
        finally:
            self._node.destroy_client(client)

    def find(self, name: str) -> str:
        """
        Wait for the node to check; return its full name.

        name: that it must have; empty for any.

        Raises
        ------
        NoNodeError: if there is none, or more than one.

        """
        topic = PARTS[self._kind]
        def is_found() -> bool:
            names = publisher_names(self._node, topic)
            return name in names if name else bool(names)
        self.wait(is_found, FIND_TIME)
        names = publisher_names(self._node, topic)
        if len(names) != 1 or name not in ('', names[0]):
            raise NoNodeError(
                f'a {self._kind} must be the only publisher on the topic {topic.name}'
                + (f' and be called {name}' if name else '') + ', got '
                + (', '.join(names) or 'none') + f' within {FIND_TIME:g} s')
        self._name = names[0]
        return self._name

    def common_verdicts(self) -> tuple[Verdict, ...]:
        """Return the verdicts on rules for all nodes that the graph shows."""
        wrong = [f'{topic.name}: {info.qos_profile.reliability.name.lower()}, '
                 f'{info.qos_profile.durability.name.lower()}'
                 for topic in RECEIVED[self._kind]
                 for info in self._node.get_publishers_info_by_topic(topic.name)
                 if full_name(info) == self._name and (
                     info.qos_profile.reliability, info.qos_profile.durability) != (
                         ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL)]
        self.wait(self._has_status, STATUS_TIME)
        return (Verdict('P1', FAIL if wrong else PASS, 'reliable and transient local publishers',
                        '; '.join(wrong)),
                Verdict('P12', PASS if self._has_status() else FAIL,
                        'the status of the node on /diagnostics once a second', 'none'))

    def _has_status(self) -> bool:
        return any(name.rpartition('/')[2] == self._name.rpartition('/')[2]
                   for name in self.statuses)

    def _listen(self, topic: Topic) -> None:
        decode, name = decoder(topic), topic.tuple_type.__name__

        def on_message(msg: Any) -> None:
            values = decode(msg)
            if name == 'WorldDescription' and values.run in self._sent_worlds:
                return  # of this check itself
            self.received[name].append(Received(time.monotonic(), values))
        self._node.create_subscription(topic.message, topic.name, on_message, topic.qos)


def option_parser() -> argparse.ArgumentParser:
    """Return the parser of the options."""
    parser = CommandParser('check', description='Check whether a running world, mentor or learner '
                           'follows the rules of docs/reference/protocol.md. This command plays '
                           'the other two parts, which must not run. --ros-args follows last.')
    add = parser.add_argument
    add('kind', choices=tuple(RECEIVED), help='what the node is')
    add('--name', default='', metavar='/NODE', help='full name that the node must have')
    add('--map', default='bar_grid', metavar='NAME|FILE',
        help='world in which a mentor or learner is checked: '
        f'{", ".join(map_names())}, {OTHER_MAPS} (default: %(default)s)')
    add('--seed', type=whole_number, default=0, metavar='K',
        help='of what this command draws (default: %(default)s)')
    add('--only', nargs='+', default=(), metavar='ID', help='rules to report, such as W6')
    add('--junit', type=Path, metavar='FILE', help='write the verdicts as JUnit XML')
    return parser


def verdict_lines(verdict: Verdict, title: str) -> Iterator[str]:
    """Yield the lines about a verdict: one, and of a failure what shows it."""
    weak = ' (SHOULD)' if verdict.result == FAIL and verdict.rule in SHOULD else ''
    yield f'{verdict.result:12}{verdict.rule:5}{title}{weak}'
    if verdict.result == FAIL:
        yield f'{"":17}expected: {verdict.expected}'
        yield f'{"":17}got: {verdict.got}'
        for message in verdict.messages:
            text = repr(message)
            yield f'{"":17}{text if len(text) <= 300 else text[:297] + "..."}'


def write_junit(path: Path, name: str, verdicts: tuple[Verdict, ...],
                titles: Mapping[str, str]) -> None:
    """Write the verdicts to a file, each as a test case; raises OSError."""
    suite = ElementTree.Element('testsuite', name=f'comply_ros check {name}', tests=str(
        len(verdicts)), failures=str(sum(each.result == FAIL for each in verdicts)), skipped=str(
            sum(each.result == NOT_REACHED for each in verdicts)))
    for each in verdicts:
        case = ElementTree.SubElement(suite, 'testcase', classname=name,
                                      name=f'{each.rule} {titles[each.rule]}')
        if each.result == FAIL:
            failure = ElementTree.SubElement(
                case, 'failure', message=f'expected {each.expected}, got {each.got}')
            failure.text = '\n'.join(map(repr, each.messages))
        elif each.result == NOT_REACHED:
            ElementTree.SubElement(case, 'skipped', message='not reached')
    ElementTree.ElementTree(suite).write(path, encoding='utf-8', xml_declaration=True)


def checked(channel: RosChannel, options: argparse.Namespace) -> tuple[Verdict, ...]:
    """Return the verdicts on the node of a channel."""
    if options.kind == 'world':
        found = check_world.WorldCheck(channel, options.seed).run()
    else:
        source = read_map(options.map, 'published')
        check = (check_mentor.MentorCheck if options.kind == 'mentor'
                 else check_learner.LearnerCheck)
        found = check(source, channel, options.seed).run()
    return (*channel.common_verdicts(), *found)


@contextmanager
def ros_channel(kind: str, arguments: Sequence[str]) -> Iterator[RosChannel]:
    """Give a channel, with ROS started. arguments: those of ROS, such as a namespace."""
    start_rclpy(['check', *arguments])
    node = rclpy.create_node('check')
    try:
        yield RosChannel(node, kind)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def main(argv: list[str]) -> int:
    """Check a node; return 0 if no MUST is broken, 1 if one is, 2 without a node."""
    parser = option_parser()
    end = argv.index(ROS_ARGUMENTS) if ROS_ARGUMENTS in argv else len(argv)
    options = parser.parse_args(argv[1:end])
    titles = {**COMMON_RULES, **RULES[options.kind]}
    for rule in options.only:
        if rule not in titles:
            parser.error(f'argument --only must be of {", ".join(titles)}, got {rule!r}')
    try:
        with ros_channel(options.kind, argv[end:]) as channel:
            name = channel.find(options.name)
            verdicts = checked(channel, options)
    except (MapError, NoNodeError, RosStartError) as error:
        return _failed(str(error))
    verdicts = tuple(each for each in verdicts if not options.only or each.rule in options.only)
    for verdict in verdicts:
        print('\n'.join(verdict_lines(verdict, titles[verdict.rule])))
    if options.junit:
        try:
            write_junit(options.junit, name, verdicts, titles)
        except OSError as error:
            return _failed(f'{options.junit} cannot be written ({error.strerror})')
    print(summary(f'{options.kind} {name}', verdicts))
    return int(breaks_a_must(verdicts))


def _failed(sentence: str) -> int:
    print(f'check: {sentence}', file=sys.stderr)
    return 2
