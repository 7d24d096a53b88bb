# SPDX-License-Identifier: Apache-2.0
"""`replay BAG`: verifies that a fresh learner publishes what was recorded."""

import argparse
from collections.abc import Iterator
import sys
from typing import Any

from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.learner_replay import LearnerReplay, MissingMessage, place, ReplayDifference
from comply_ros.bags.message_decoder import DecodedMessages
from comply_ros.bags.replay_check import ReplayCheck
from comply_ros.learner.learner_config import ConfigError
from comply_ros.storage.file_system import printable
from comply_ros.terminal.command_line import CommandParser
from comply_ros.terminal.console import progress_bar
from comply_ros.terminal.training_options import guarded

PROGRESS_INTERVAL = 1000  # messages between two updates of the progress bar


def main(argv: list[str]) -> int:
    """Run the command; return the exit code: 0 verified, 1 not, 2 a mistake."""
    options = bag_parser('replay', 'Give a fresh learner what a recorded one received, and verify '
                         'that it publishes the same.').parse_args(argv[1:])
    return guarded('replay', (BagError, ConfigError), lambda: run(options))


def bag_parser(program: str, description: str) -> argparse.ArgumentParser:
    """`ArgumentParser` of a command that reads a bag."""
    parser = CommandParser(program, description=description)
    parser.add_argument('bag', metavar='BAG', help='folder of a bag, or its .mcap or .db3 file')
    parser.add_argument('--namespace', metavar='NAME',
                        help='of the nodes, if the bag has a world in more than one namespace')
    return parser


def run(options: argparse.Namespace) -> int:
    """Replay a bag, print what was verified and what was not; return the exit code."""
    messages, check = DecodedMessages(Bag(options.bag), options.namespace), ReplayCheck()
    difference = None
    try:
        for topic, msg in with_progress(messages, 'replay'):
            check.add(topic, msg)
        check.finish()
    except ReplayDifference as error:
        difference = error
    for replay in check.replays:
        print(result_text(replay))
    for learner in check.unverifiable.values():
        print(f'not verifiable: learner {learner.number} {learner.reason}, so its initial state '
              'is unknown; '
              f'{learner.possible} actions fit their observations')
    if difference:
        stopped = isinstance(difference, MissingMessage)
        print(f'{"verification stopped" if stopped else "difference"}: {difference}')
    elif not check.replays and not check.unverifiable:
        raise BagError('the bag must have the actions of a learner, and has none')
    matching = any(replay.matching for replay in check.replays)
    return 0 if matching and not check.unverifiable and not difference else 1


def result_text(replay: LearnerReplay) -> str:
    """Return what was verified of one learner."""
    learner = replay.description
    name = f'learner {learner.learner} ({learner.method}, seed {learner.seed})'
    if not replay.matching or replay.first is None or replay.last is None:
        return f'nothing to verify: {name} published no action'
    parts = [f'verified: {name}: {replay.matching} matching actions, from {place(replay.first)}, '
             f'to {place(replay.last)}']
    parts.append(f'{replay.digests} matching digest{"s" * (replay.digests > 1)}, the last '
                 f'{replay.digest}' if replay.digests else 'no digest was recorded')
    if replay.inferred:
        parts.append(f'{replay.inferred} more actions are not in the bag and were inferred from '
                     'its observations')
    if replay.unadvised:
        parts.append(f'the advice for {replay.unadvised} actions is not in the bag')
    if not replay.learner.finished:
        parts.append('its training had not finished')
    return '; '.join(parts)


def with_progress(messages: DecodedMessages, program: str) -> Iterator[tuple[str, Any]]:
    """Yield each message and show a progress bar; then report where the bag was cut off."""
    bag = messages.bag
    with progress_bar() as progress:
        task = progress.add_task(program, total=bag.expected_count, now='messages')
        for number, message in enumerate(messages):
            yield message
            if number % PROGRESS_INTERVAL == 0:
                progress.update(task, completed=bag.count)
        progress.update(task, completed=bag.count)
    if bag.truncation:
        print(f'{program}: bag {printable(bag.path)} was cut off: {bag.truncation}; read up to '
              f'the last complete message, {bag.count} in all', file=sys.stderr)
