# SPDX-License-Identifier: Apache-2.0
"""`replay BAG`: proves that a fresh learner would have said what was recorded."""

import argparse
import sys

from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.learner_replay import MissingMessage, ReplayDifference
from comply_ros.bags.message_decoder import DecodedMessages
from comply_ros.bags.replay_check import ReplayCheck
from comply_ros.storage.file_system import printable
from comply_ros.terminal.console import progress_bar
from comply_ros.terminal.training_options import guarded

SHOWN = 1000  # messages between two looks of the progress bar


def main(argv):
    """Run the command; return the exit code: 0 proven, 1 not, 2 a mistake."""
    given = bag_parser('replay', 'Tell a fresh learner what a recorded one was told, and prove '
                       'that it says the same.').parse_args(argv[1:])
    return guarded('replay', (BagError,), lambda: run(given))


def bag_parser(program, description):
    """`ArgumentParser` of a command that reads a bag."""
    parser = argparse.ArgumentParser(program, description=description)
    parser.add_argument('bag', metavar='BAG', help='folder of a bag, or its .mcap or .db3 file')
    parser.add_argument('--namespace', metavar='NAME',
                        help='of the nodes, where the bag has more than one conversation')
    return parser


def run(given):
    """Replay a bag, say what was proven, return the exit code."""
    conversation, proof = DecodedMessages(Bag(given.bag), given.namespace), ReplayCheck()
    difference = None
    try:
        for topic, msg in shown(conversation, 'replay'):
            proof.hear(topic, msg)
        proof.end()
    except ReplayDifference as found:
        difference = found
    tell_cut('replay', conversation.bag)
    return report(proof, difference)


def report(proof, difference):
    """Print what was proven and what was not; return the exit code."""
    for each in proof.proven:
        print(sentence(each))
    for each in proof.unknown.values():
        print(f'not proven: learner {each.number} was recorded from run {each.first[0]}, turn '
              f'{each.first[1]} on, and not from its start, so what it had learned is not known; '
              f'{each.fits} answers fit their questions')
    if difference:
        ends = type(difference) is MissingMessage
        print(f'{"not proven further" if ends else "differs"}: {difference}')
    if not proof.proven and not proof.unknown and not difference:
        raise BagError('the bag must have the answers of a learner, and has none')
    proven = [each for each in proof.proven if each.same]
    return 0 if proven and not proof.unknown and not difference else 1


def sentence(told):
    """Return what was proven of one learner."""
    described = told.described
    who = f'learner {described.learner} ({described.method}, seed {described.seed})'
    if not told.same:
        return f'nothing to prove: {who} has answered nothing'
    where = (f'{told.same} answers, from run {told.first[0]}, turn {told.first[1]}, to run '
             f'{told.last[0]}, turn {told.last[1]}')
    digest = (f'the same {told.digests} digest{"s" * (told.digests > 1)}, the last {told.digest}'
              if told.digests else 'no digest was recorded')
    remarks = [text for text, is_so in (
        (f'{told.inferred} more are not in the bag, and follow from its states', told.inferred),
        (f'the advice of {told.unheard} is not in the bag', told.unheard),
        ('its learning had not ended', not told.finished)) if is_so]
    return '; '.join((f'the same: {who}, {where}', digest, *remarks))


def shown(conversation, program):
    """Yield what was said, with a progress bar."""
    with progress_bar() as bar:
        task = bar.add_task(program, total=conversation.bag.expected, now='messages')
        for number, each in enumerate(conversation):
            yield each
            if number % SHOWN == 0:
                bar.update(task, completed=conversation.bag.count)
        bar.update(task, completed=conversation.bag.count)


def tell_cut(program, bag):
    """Say where a bag was cut off."""
    if bag.cut:
        print(f'{program}: bag {printable(bag.path)} was cut off: {bag.cut}; read up to the last '
              f'whole message, {bag.count} in all', file=sys.stderr)
