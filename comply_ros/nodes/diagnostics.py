# SPDX-License-Identifier: Apache-2.0
"""The health of a node, as it publishes it on `/diagnostics`, in the words of the README."""

from collections import Counter
import os
import time
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

if TYPE_CHECKING:
    from comply_ros.storage.checkpoint_store import CheckpointStore

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
TOPIC = '/diagnostics'  # of the whole system, whatever the namespace, as ROS tools expect
RUN = 'run'  # key of the run of a world
INACTIVE = 'inactive'  # first word of the status of a node that gave way to another one


class Diagnostics:
    """
    Counts what a node does, and publishes it with its status.

    Attributes
    ----------
    rejected: how many messages of each kind were invalid.
    ignored: how many messages of each kind were late or repeated.

    """

    def __init__(self, node: Node) -> None:
        self.rejected: Counter[str] = Counter()
        self.ignored: Counter[str] = Counter()
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, 10)
        self._steps, self._time = 0, time.monotonic()

    def publish(self, level: bytes, message: str, steps: int, store: 'CheckpointStore | None',
                run: int | None = None) -> None:
        """
        Publish a status.

        steps: taken so far.
        store: with the checkpoint of the node, None where it has none.
        run: of a world.

        """
        now = time.monotonic()
        rate = max(0, steps - self._steps) / max(now - self._time, 1e-9)
        self._steps, self._time = steps, now
        values = {'steps per second': f'{rate:.0f}', 'steps': steps,
                  **{f'rejected: {kind}': count for kind, count in self.rejected.items()},
                  **{f'ignored: {kind}': count for kind, count in self.ignored.items()}}
        if run is not None:
            values[RUN] = run
        if store is None:
            values['state_dir'] = 'nothing is stored'
        else:
            values['journal bytes'] = store.journal_bytes
            written = store.checkpoint_time
            values['last checkpoint'] = 'none yet' if written is None else time.strftime(
                '%Y-%m-%d %H:%M:%S', time.localtime(written))
        array = DiagnosticArray(status=[DiagnosticStatus(
            level=level, name=self._node.get_fully_qualified_name().lstrip('/'), message=message,
            hardware_id=process_name(os.getpid()),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)


def process_name(pid: int) -> str:
    """Name of a process on this machine: two nodes can have the same name by mistake."""
    return f'process {pid} on {os.uname().nodename}'
