# SPDX-License-Identifier: Apache-2.0
"""Three mentors of MountainCar in 40 x 40 cells: `swing`, `look` or `right` behind the command."""

from contextlib import suppress
import sys

from comply_msgs.msg import Recommendation, StateReward
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

BINS, LEFT, RIGHT = 40, 0, 2


def swing(position, velocity):
    """Return the push the way that the car moves: it swings itself up, in 120 steps or so."""
    return RIGHT if velocity >= 0.0 else LEFT


def look(position, velocity):
    """Return a push that depends on the position too: it takes about 105 steps."""
    low = min(-0.09 * (position + 0.25) ** 2 + 0.03, 0.3 * (position + 0.9) ** 4 - 0.008)
    high = -0.07 * (position + 0.38) ** 2 + 0.07
    return RIGHT if low <= velocity <= high else LEFT


def right(position, velocity):
    """Return a push to the goal, which the motor is too weak for."""
    return RIGHT


def advice(mentor, state):
    """Return the action of a mentor in the middle of the cell of a state."""
    x, v = divmod(state, BINS)
    return mentor(-1.2 + (x + 0.5) * 1.8 / BINS, -0.07 + (v + 0.5) * 0.14 / BINS)


def main():
    """Answer every observation."""
    def on_state(msg):
        publisher.publish(Recommendation(run=msg.run, episode=msg.episode, step=msg.step,
                                         state=msg.state, action=advice(mentor, msg.state)))
    mentor = {'swing': swing, 'look': look, 'right': right}[sys.argv[1]]
    rclpy.init()
    node = rclpy.create_node('mountain_car_mentor')
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = node.create_publisher(Recommendation, 'recommendation', latched)
    node.create_subscription(StateReward, 'state', on_state, latched)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == '__main__':
    main()
