# SPDX-License-Identifier: Apache-2.0
"""The command `check`: whether a live world, mentor or learner follows the protocol."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
import sys
from textwrap import wrap
import time
from typing import Any

import rclpy

from comply_ros.nodes.check_channel import NoNodeError, RECEIVED, RosChannel
from comply_ros.nodes.check_live_nodes import common_verdicts
from comply_ros.nodes.check_live_nodes import RULES as COMMON_RULES
from comply_ros.nodes.check_report import FailureBag, verdict_lines, write_bag, write_junit
from comply_ros.nodes.ros_start import RosStartError, start_rclpy
from comply_ros.nodes.started_node import SEED, StartedNode
from comply_ros.protocol import check_learner, check_mentor, check_world
from comply_ros.protocol.check_plan_shortening import Plan, shortest_failure
from comply_ros.protocol.rule_report import (
    breaks_a_must,
    FAIL,
    PATIENCE,
    SHOULD,
    summary,
    Verdict,
)
from comply_ros.storage.file_system import reason_of
from comply_ros.storage.map_files import read_map
from comply_ros.storage.map_name import map_names, OTHER_MAPS
from comply_ros.terminal.command_line import CommandParser, file_to_write, whole_number
from comply_ros.terminal.interrupts import interrupts
from comply_ros.terminal.training_options import guarded
from comply_ros.world.grid import MapError

ROS_ARGUMENTS = '--ros-args'
SHORTENING_TIME = 15.0  # seconds in which the transcript of a failure is shortened
MOST_SHORTENED = 4  # failures of which the transcript is shortened, those of a MUST first
SHORT_PATIENCE = 2.0  # seconds that an answer may take meanwhile
RULES: dict[str, Mapping[str, str]] = {
    'world': check_world.RULES, 'mentor': check_mentor.RULES, 'learner': check_learner.RULES}
PLANS: dict[str, Plan] = {
    'world': check_world.world_plan(), 'mentor': check_mentor.PLAN, 'learner': check_learner.PLAN}


def option_parser() -> argparse.ArgumentParser:
    """Return the parser of the options."""
    parser = CommandParser('check', description='Check whether a running world, mentor or learner '
                           'follows the rules of docs/reference/protocol.md. This command plays '
                           'the other two parts, which must not run. --ros-args follows last.')
    add = parser.add_argument
    add('kind', choices=tuple(RECEIVED), metavar=f'{{{",".join(RECEIVED)}}}',
        help='what the node is')
    add('--name', default='', metavar='/NODE', help='full name that the node must have')
    add('--start', metavar='COMMAND',
        help=f'starts the node, with the seed in place of {SEED}, and again where a rule is about '
        'that; without it, the node must run')
    add('--map', default='bar_grid', metavar='NAME|FILE',
        help='world in which a mentor or learner is checked: '
        f'{", ".join(map_names())}, {OTHER_MAPS} (default: %(default)s)')
    add('--seed', type=whole_number, default=0, metavar='K',
        help='of what this command draws, and of --start (default: %(default)s)')
    add('--only', nargs='+', default=(), metavar='ID', help='rules to report, such as W6')
    add('--junit', type=file_to_write, metavar='FILE', help='write the verdicts as JUnit XML')
    add('--bags', type=Path, metavar='DIR',
        help='where the messages of each failure are written (default: runs/check-TIME)')
    return parser


def checked(channel: RosChannel, options: argparse.Namespace, plan: Plan,
            patience: float = PATIENCE) -> tuple[Verdict, ...]:
    """Return the verdicts on the node of a channel."""
    if options.kind == 'world':
        return check_world.WorldCheck(channel, options.seed, plan, patience).run()
    check: Any = (check_mentor.MentorCheck if options.kind == 'mentor'
                  else check_learner.LearnerCheck)
    source = read_map(options.map, 'published')
    return check(source, channel, options.seed, plan, patience).run()


def failure_bags(channel: RosChannel, options: argparse.Namespace,
                 verdicts: Sequence[Verdict], most_shortened: int = MOST_SHORTENED,
                 ) -> Iterator[tuple[str, FailureBag]]:
    """Shorten the transcript of some failures, write all; yield rule and bag of each."""
    folder = options.bags or Path(time.strftime('runs/check-%Y-%m-%d-%H-%M-%S'))
    failures = sorted((each for each in verdicts if each.result == FAIL and each.transcript),
                      key=lambda each: each.rule in SHOULD)
    for number, verdict in enumerate(failures):
        end = time.monotonic() + SHORTENING_TIME

        def check(shorter: Plan, end: float = end) -> Sequence[Verdict]:
            if time.monotonic() > end:
                return ()
            return checked(channel, options, shorter, SHORT_PATIENCE)
        shortest = verdict
        if number < most_shortened:
            print(f'check: repeats what broke {verdict.rule}, to shorten it', file=sys.stderr)
            try:
                shortest = shortest_failure(verdict, PLANS[options.kind], check)
            except NoNodeError as error:  # what was found before stays
                print(f'check: does not shorten it: {error}', file=sys.stderr)
        yield verdict.rule, write_bag(folder / verdict.rule, options.kind,
                                      shortest.transcript, channel.namespace)


@contextmanager
def ros_channel(options: argparse.Namespace, arguments: Sequence[str]) -> Iterator[RosChannel]:
    """Give a channel to the node, with ROS started. arguments: those of ROS, as a namespace."""
    start_rclpy(['check', *arguments])
    node = rclpy.create_node('check')
    started = None if options.start is None else StartedNode(options.start)
    with interrupts() as stop:
        try:
            channel = RosChannel(node, options.kind, stop, started, options.seed)
            if started:
                _start(started, options)
            channel.find(options.name)
            yield channel
        finally:
            if started:
                started.end()
            node.destroy_node()
            rclpy.try_shutdown()


def _start(started: StartedNode, options: argparse.Namespace) -> None:
    try:
        started.start(options.seed)
    except (OSError, ValueError) as error:
        reason = reason_of(error) if isinstance(error, OSError) else error
        raise NoNodeError(f'--start must be a command that can be run, got {options.start!r} '
                          f'({reason})') from None


def main(argv: list[str]) -> int:
    """Check a node; return 0 if no MUST is broken, 1 if one is, 2 without a node."""
    parser = option_parser()
    end = argv.index(ROS_ARGUMENTS) if ROS_ARGUMENTS in argv else len(argv)
    options = parser.parse_args(argv[1:end])
    titles = {**COMMON_RULES, **RULES[options.kind]}
    for rule in options.only:
        if rule not in titles:
            parser.error(f'argument --only must be of {", ".join(titles)}, got {rule!r}')
    return guarded('check', (MapError, NoNodeError, RosStartError),
                   lambda: _check(options, argv[end:], titles))


def _check(options: argparse.Namespace, arguments: Sequence[str],
           titles: Mapping[str, str]) -> int:
    """Check the node, print and write the verdicts; return the exit code."""
    with ros_channel(options, arguments) as channel:
        found = checked(channel, options, PLANS[options.kind])
        verdicts = tuple(each for each in (*common_verdicts(channel, options.kind), *found)
                         if not options.only or each.rule in options.only)
        bags = dict(failure_bags(channel, options, verdicts,
                                 0 if channel.is_gone() else MOST_SHORTENED))
        has_ended = channel.has_ended()
    code = _report(options, channel.name, verdicts, titles, bags)
    if has_ended:
        print(f'check: {channel.name} has ended during the check', file=sys.stderr)
    return code or int(has_ended)


def _report(options: argparse.Namespace, name: str, verdicts: tuple[Verdict, ...],
            titles: Mapping[str, str], bags: Mapping[str, FailureBag]) -> int:
    """Print and write the verdicts; return the exit code."""
    from comply_ros.terminal.console import console
    for verdict in verdicts:
        for line in verdict_lines(verdict, titles[verdict.rule], console.width,
                                  bags.get(verdict.rule)):
            print(line)
    if options.junit:
        try:
            write_junit(options.junit, name, verdicts, titles, bags)
        except OSError as error:
            print(f'check: {options.junit} cannot be written ({error.strerror})', file=sys.stderr)
            return 2
    print('\n'.join(wrap(summary(f'{options.kind} {name}', verdicts), console.width,
                         break_on_hyphens=False)))
    return int(breaks_a_must(verdicts))
