# SPDX-License-Identifier: Apache-2.0
"""A learner node: Q-learning that follows the advice that it has in every second state."""

from collections import defaultdict
from contextlib import suppress
import random

from comply_msgs.msg import Action, Recommendation, StateReward, WorldDescription
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
NUMBER = random.randrange(1, 2 ** 32)
world = asked = answer = expected = held = None
advice, q = {}, defaultdict(float)


def on_world(msg):
    """Follow the first world, and the same one after a reset (rules P8 and P9)."""
    global world, answer, expected
    if msg.protocol == msg.PROTOCOL and (not world or msg.replaces == world.run):
        world, answer, expected = msg, None, (1, 0)


def on_state(msg):
    """Answer the next observation; repeat the answer to the last one (L3 to L6, L12, L13)."""
    global asked, answer, expected, held
    here = msg.episode, msg.step
    if not world or msg.run != world.run or msg.learner not in (0, NUMBER):
        return
    last = (answer.episode, answer.step) if answer else (0, 0)
    if here == last:
        actions.publish(answer)
    if here <= last or here not in (expected, held):
        held = here  # where it joins late, it answers when this is repeated
        return
    if here == expected and msg.step and answer:  # Q-learning
        best = 0.0 if msg.terminated else max(q[msg.state, a] for a in available(msg.state))
        q[asked[-1], answer.action] += 0.2 * (msg.reward + best - q[asked[-1], answer.action])
    action = Action.NONE if (over := msg.terminated or msg.truncated) else choose(msg.state)
    answer = Action(run=msg.run, episode=msg.episode, step=msg.step, action=action, learner=NUMBER)
    asked, held = (msg.run, *here, msg.state), None
    expected = (msg.episode + 1, 0) if over else (msg.episode, msg.step + 1)
    actions.publish(answer)


def on_recommendation(msg):
    """Remember the advice for a state that was observed (L10)."""
    if (msg.run, msg.episode, msg.step, msg.state) == asked:
        advice[msg.state] = msg.action


def available(s):
    """Return the actions that a state has."""
    n, first = len(world.actions), world.table.first
    if world.model == WorldDescription.TABLE:
        return [a for a in range(n) if first[s * n + a] < first[s * n + a + 1]]
    if world.model == WorldDescription.NONE:
        return [a for a in range(n) if not world.available or world.available[s * n + a]]
    width = len(world.grid.rows[0])
    inside = s % width > 0, s % width < width - 1, s >= width, s < world.states - width
    return [a for a in range(n) if inside[a]]


def choose(s):
    """Return the advice, any action, or the best one."""
    if s % 2 and advice.get(s, -1) >= 0:
        return advice[s]
    return random.choice(available(s)) if random.random() < 0.1 else max(
        available(s), key=lambda a: q[s, a])


rclpy.init()
node = rclpy.create_node('own_learner')
actions = node.create_publisher(Action, 'action', LATCHED)
node.create_subscription(WorldDescription, 'world', on_world, LATCHED)
node.create_subscription(StateReward, 'state', on_state, LATCHED)
node.create_subscription(Recommendation, 'recommendation', on_recommendation, LATCHED)
with suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(node)
