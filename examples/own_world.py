# SPDX-License-Identifier: Apache-2.0
"""A world node: a corridor of ten cells, where one step in three goes the other way."""

from contextlib import suppress
import random
import time

from comply_msgs.msg import Action, StateReward, WorldDescription
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
GOAL, STEP_LIMIT, PATIENCE = 9, 50, 3.0
RUN = random.randrange(1, 2 ** 32)


def on_action(msg):
    """Take a step, if the action is one for the open observation (rule W12)."""
    global observation, heard
    here, over = observation, observation.terminated or observation.truncated
    if (msg.run, msg.episode, msg.step) != (RUN, here.episode, here.step) \
            or here.learner not in (0, msg.learner) \
            or msg.action not in ((Action.NONE,) if over else (0, 1)):
        return
    observation, heard = next_observation(here, over, msg.action), time.monotonic()
    observation.learner = msg.learner
    states.publish(observation)


def next_observation(here, over, action):
    """Return what follows from an action, or the start of the next episode."""
    if over:
        return StateReward(run=RUN, episode=here.episode + 1)
    direction = random.choice((1, 1, -1)) if action else random.choice((-1, -1, 1))
    state = max(0, here.state + direction)
    return StateReward(
        run=RUN, episode=here.episode, step=here.step + 1, state=state,
        reward=1.0 if state == GOAL else -0.1, terminated=state == GOAL,
        truncated=here.step + 1 == STEP_LIMIT and state != GOAL)


def repeat():
    """Publish the open observation again; a learner that is gone loses its run (W11, W14)."""
    if time.monotonic() > heard + PATIENCE:
        observation.learner = 0
        worlds.publish(description)
    states.publish(observation)


rclpy.init()
node = rclpy.create_node('own_world')
worlds, states = (node.create_publisher(kind, name, LATCHED) for kind, name in (
    (WorldDescription, 'world'), (StateReward, 'state')))
description = WorldDescription(
    protocol=WorldDescription.PROTOCOL, run=RUN, name='corridor', states=GOAL + 1,
    actions=['back', 'forth'], step_limit=STEP_LIMIT, model=WorldDescription.NONE)
observation, heard = StateReward(run=RUN, episode=1), time.monotonic()
worlds.publish(description)
node.create_subscription(Action, 'action', on_action, LATCHED)
node.create_timer(0.1, repeat)
repeat()
with suppress(KeyboardInterrupt, ExternalShutdownException):  # Ctrl-C, and the end of ROS
    rclpy.spin(node)
