# SPDX-License-Identifier: Apache-2.0
"""A mentor node that breaks one rule of the protocol, of those that only a live node shows."""

import sys

from comply_msgs.msg import Policy, Recommendation, StateReward, WorldDescription
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def main(broken):
    """Run the mentor until it is ended. broken: the rule."""
    rclpy.init()
    node = rclpy.create_node('broken_mentor')
    qos = 1 if broken == 'P1' else LATCHED
    advice = node.create_publisher(Recommendation, 'recommendation', qos)
    policy = node.create_publisher(Policy, 'mentor_policy', qos)
    status = node.create_publisher(DiagnosticArray, '/diagnostics', 1)

    def stamped(msg):
        if broken != 'P4':
            msg.header.stamp = node.get_clock().now().to_msg()
        return msg

    def on_world(msg):
        policy.publish(stamped(Policy(run=msg.run, action=[-1] * msg.states)))

    def on_state(msg):
        if not msg.terminated:
            advice.publish(stamped(Recommendation(
                run=msg.run, episode=msg.episode, step=msg.step, state=msg.state, action=-1)))

    node.create_subscription(WorldDescription, 'world', on_world, LATCHED)
    node.create_subscription(StateReward, 'state', on_state, LATCHED)
    if broken != 'P12':
        node.create_timer(0.5, lambda: status.publish(DiagnosticArray(
            status=[DiagnosticStatus(name='broken_mentor')])))
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main(sys.argv[1])
