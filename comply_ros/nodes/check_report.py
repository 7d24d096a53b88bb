# SPDX-License-Identifier: Apache-2.0
"""What `check` shows and writes: lines, JUnit, and a bag of each failure."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping, Sized
from pathlib import Path
from textwrap import wrap
import time
from typing import Any, NamedTuple
import xml.etree.ElementTree as ElementTree

from comply_ros.nodes.check_channel import RECEIVED, SENT
from comply_ros.nodes.topic_type_check import type_name
from comply_ros.nodes.topics import encoder
from comply_ros.protocol.messages import NANOSECONDS
from comply_ros.protocol.rule_report import FAIL, NOT_REACHED, Received, SHOULD, Verdict
from comply_ros.storage.file_system import printable, reason_of

INDENT = 17  # columns of the result and the rule
SHOWN_ELEMENTS = 4  # of a field with many


class FailureBag(NamedTuple):
    """The bag of a failure, or why there is none."""

    path: Path
    messages: int
    problem: str = ''

    def __str__(self) -> str:
        """Return one line for the report."""
        return self.problem or (f'{printable(self.path)} ({self.messages} '
                                f'message{"s" * (self.messages != 1)})')


def verdict_lines(verdict: Verdict, title: str, width: int,
                  bag: FailureBag | None = None) -> Iterator[str]:
    """Yield the lines about a verdict: one, and of a failure what shows it."""
    weak = ' (SHOULD)' if verdict.result == FAIL and verdict.rule in SHOULD else ''
    yield from _wrapped(f'{verdict.result:12}{verdict.rule:5}', f'{title}{weak}', width)
    if verdict.result != FAIL:
        return
    indent = ' ' * INDENT
    for text in (f'expected: {verdict.expected}', f'got: {verdict.got}'):
        yield from _wrapped(indent, text, width)
    for message in verdict.messages:
        yield from _wrapped(indent, message_text(message), width)
    if bag:
        yield from _wrapped(indent, f'bag: {bag}', width, breaks_words=False)


def message_text(value: Any) -> str:
    """Return a message as text, without empty fields, and with the beginning of long ones."""
    if hasattr(value, '_fields'):
        fields = (f'{name}={message_text(each)}' for name, each in zip(value._fields, value)
                  if not (isinstance(each, Sized) and not (len(each) and _content(each))))
        return f'{type(value).__name__}({", ".join(fields)})'
    if isinstance(value, tuple | list | array):
        shown = ', '.join(map(message_text, value[:SHOWN_ELEMENTS]))
        more = len(value) - SHOWN_ELEMENTS
        return f'({shown}, {more} more)' if more > 0 else f'({shown})'
    return repr(value)


def _content(value: Any) -> Any:
    """Return what a field has: of the model of a world its rows, or first elements."""
    return len(value[0]) if hasattr(value, '_fields') else value


def _wrapped(head: str, text: str, width: int, breaks_words: bool = True) -> list[str]:
    """
    Return a text in lines, the first one after a head, the others indented as far.

    breaks_words: whether a word that is longer than a line is broken; not a path, to be copied.
    """
    return wrap(head + text, max(width, 2 * INDENT), subsequent_indent=' ' * INDENT,
                break_on_hyphens=False, break_long_words=breaks_words) or [head]


def write_junit(path: Path, name: str, verdicts: tuple[Verdict, ...],
                titles: Mapping[str, str], bags: Mapping[str, FailureBag]) -> None:
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
            failure.text = '\n'.join([*map(message_text, each.messages), *(
                [f'bag: {bags[each.rule]}'] if each.rule in bags else [])])
        elif each.result == NOT_REACHED:
            ElementTree.SubElement(case, 'skipped', message='not reached')
    ElementTree.ElementTree(suite).write(path, encoding='utf-8', xml_declaration=True)


def write_bag(path: Path, kind: str, transcript: tuple[Received, ...],
              namespace: str) -> FailureBag:
    """Write a transcript as a bag, each message with the time at which it came or was sent."""
    try:
        from comply_ros.bags.bag_writer import BagWriter, latched
        from comply_ros.nodes.record import message_definitions
    except ModuleNotFoundError as error:
        return FailureBag(path, 0, f'not written: needs the Python package {error.name}')
    topics = {each.tuple_type: each for each in (*RECEIVED[kind], *SENT[kind])}
    start = time.time_ns() - time.monotonic_ns()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        bag = BagWriter(path, message_definitions())
        names, makers = {}, {}
        for tuple_type, topic in topics.items():
            names[tuple_type] = f'{namespace.rstrip("/")}/{topic.name}'
            bag.add(names[tuple_type], type_name(topic.message), (latched(topic.qos.depth),))
            makers[tuple_type] = encoder(topic)
        for each in transcript:
            stamp, kind_of = start + int(each.time * 1e9), type(each.message)
            msg = makers[kind_of](each.message)
            msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(stamp, NANOSECONDS)
            bag.write(names[kind_of], stamp, bag.serialized(type_name(type(msg)), msg))
        bag.close()
    except OSError as error:
        return FailureBag(path, 0, f'not written: {printable(path)} ({reason_of(error)})')
    return FailureBag(path, len(transcript))
