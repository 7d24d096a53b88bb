# SPDX-License-Identifier: Apache-2.0
"""A mentor node: points straight to the goal, whatever is in the way."""

from comply_msgs.msg import Recommendation, StateReward, WorldDescription
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
worlds = {}


def on_world(msg):
    """Remember a world, if its messages are of the version that this node is written for."""
    if msg.protocol == WorldDescription.PROTOCOL:
        worlds[msg.run] = msg


def on_state(msg):
    """Publish the advice in a state; a world that is not known yet repeats its message."""
    if msg.run in worlds and not msg.terminated:
        publisher.publish(Recommendation(
            run=msg.run, episode=msg.episode, step=msg.step, state=msg.state,
            action=advice(msg.state, worlds[msg.run])))


def advice(state, world):
    """Return the action that brings the robot nearer to the goal."""
    width = len(world.grid.rows[0])
    y, x = divmod(state, width)
    goal_y, goal_x = divmod(''.join(reversed(world.grid.rows)).index('G'), width)
    if abs(goal_x - x) > abs(goal_y - y):
        return Recommendation.RIGHT if goal_x > x else Recommendation.LEFT
    return Recommendation.UP if goal_y > y else Recommendation.DOWN


rclpy.init()
node = rclpy.create_node('own_mentor')
publisher = node.create_publisher(Recommendation, 'recommendation', LATCHED)
node.create_subscription(WorldDescription, 'world', on_world, LATCHED)
node.create_subscription(StateReward, 'state', on_state, LATCHED)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
