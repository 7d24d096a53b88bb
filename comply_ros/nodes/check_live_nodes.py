# SPDX-License-Identifier: Apache-2.0
"""Rules for every node that only a live one shows: QoS, late subscribers, stamps, status."""

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from comply_ros.nodes.check_channel import RECEIVED, RosChannel
from comply_ros.protocol.rule_report import FAIL, NOT_REACHED, PASS, Verdict

RULES = {
    'P1': 'publishers are reliable and transient local',
    'P2': 'late subscribers receive the last messages',
    'P4': 'headers have the time of publication',
    'P12': 'the status is published on /diagnostics'}
STATUS_TIME = 2.5  # seconds in which a node must publish its status
LONGEST_DELAY = 2.0  # seconds between a stamp and its arrival
NEVER_SET = 1e9  # seconds, as of a stamp that is 0 in 2001 or later


def common_verdicts(channel: RosChannel, kind: str) -> tuple[Verdict, ...]:
    """Return the verdicts on these rules for the node of a channel, after its check."""
    return (_qos(channel, kind), _late(channel), _stamps(channel), _status(channel))


def _qos(channel: RosChannel, kind: str) -> Verdict:
    offers = [(topic, offer) for topic in RECEIVED[kind] for offer in channel.offered(topic)]
    if not offers:  # the node has ended
        return Verdict('P1')
    wrong = [f'{topic.name}: {offer.reliability.name.lower()}, {offer.durability.name.lower()}'
             for topic, offer in offers if (offer.reliability, offer.durability) != (
                 ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL)]
    return Verdict('P1', FAIL if wrong else PASS, 'reliable and transient local publishers',
                   '; '.join(wrong))


def _late(channel: RosChannel) -> Verdict:
    """Return whether a late subscriber receives as many as the depths of the table promise."""
    channel.join_late()
    if not channel.late:
        return Verdict('P2')
    wrong = [f'{name}: {found} of {count}' for name, found, count in channel.late if found < count]
    return Verdict('P2', FAIL if wrong else PASS, 'the last messages for a late subscriber, as '
                   'many as the depth of the topic', '; '.join(wrong))


def _stamps(channel: RosChannel) -> Verdict:
    """Return whether most stamps are of the time at which their messages came."""
    delays = sorted(map(abs, channel.delays))
    if not delays:
        return Verdict('P4', NOT_REACHED)
    middle = delays[len(delays) // 2]  # a message that was latched may be old
    return Verdict('P4', PASS if middle <= LONGEST_DELAY else FAIL,
                   f'stamps at most {LONGEST_DELAY:g} s before their messages come',
                   f'{middle:.3g} s' if middle < NEVER_SET else 'stamps that are 0')


def _status(channel: RosChannel) -> Verdict:
    def is_there() -> bool:
        return any(name.rpartition('/')[2] == channel.name.rpartition('/')[2]
                   for name in channel.statuses)
    there = channel.wait(is_there, STATUS_TIME)
    return Verdict('P12', PASS if there else FAIL,
                   'the status of the node on /diagnostics once a second', 'none')
