# SPDX-License-Identifier: Apache-2.0
"""How a node is, as `/diagnostics` says it, in the words of the README's table."""

from collections import Counter
import os
import socket
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
TOPIC = '/diagnostics'  # of the whole system, whatever the namespace, as ROS tools expect
STANDS_ASIDE = 'stands aside'


class Diagnostics:
    """
    Counts what a node does, and publishes it once a second.

    Attributes
    ----------
    refused: how often each kind of message could not be right.
    dropped: how often each kind of message came late or twice.

    """

    def __init__(self, node):
        self.refused, self.dropped = Counter(), Counter()
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, 10)
        self._turns, self._time = 0, time.monotonic()

    def publish(self, level, message, turns, keeper):
        """
        Publish a status.

        turns: taken so far.
        keeper: the `StateStore`, or None.

        """
        values = {'steps per second': f'{self._rate(turns):.0f}', 'steps': turns,
                  **{f'refused: {kind}': count for kind, count in self.refused.items()},
                  **{f'dropped: {kind}': count for kind, count in self.dropped.items()},
                  **kept(keeper)}
        status = DiagnosticStatus(
            level=level, name=self._node.get_fully_qualified_name().lstrip('/'), message=message,
            hardware_id=process_name(os.getpid()),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])
        self._publisher.publish(DiagnosticArray(
            header=_stamped(self._node), status=[status]))

    def _rate(self, turns):
        now, before, since = time.monotonic(), self._turns, self._time
        self._turns, self._time = turns, now
        return max(0, turns - before) / max(now - since, 1e-9)


def process_name(pid):
    """Name of a process on this machine: two nodes can have the same name by mistake."""
    return f'process {pid} on {socket.gethostname()}'


def kept(keeper):
    """Table of what is kept on disk, for a status."""
    if keeper is None:
        return {'state_dir': 'nothing is kept'}
    written = 'none yet' if keeper.checkpoint_time is None else time.strftime(
        '%Y-%m-%d %H:%M:%S', time.localtime(keeper.checkpoint_time))
    return {'journal bytes': keeper.journal_bytes, 'last snapshot': written}


def _stamped(node):
    header = DiagnosticArray().header
    header.stamp = node.get_clock().now().to_msg()
    return header
