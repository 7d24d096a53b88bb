# SPDX-License-Identifier: Apache-2.0
"""What cannot be right in a world, and is refused: one sentence for each way to be wrong."""

from math import isfinite

from comply_ros.protocol.messages import LONGEST_NAME, Rejected
from comply_ros.world.grid import NO_ACTION


def validate_state(msg, world):
    """`Rejected` for a `StateReward` that cannot be right in this world, or None."""
    s, states = msg.state, len(world.terminal)
    if not 0 <= s < states:
        return Rejected('state outside the grid',
                       f'a state must lie in [0, {states - 1}], got {s}')
    if not isfinite(msg.reward):
        return Rejected('reward not a number',
                       f'a reward must be a finite number, got {msg.reward}')
    if world.obstacle[s]:
        return Rejected('state in an obstacle', 'a state must not be an obstacle, '
                       f'got {s} at {world.grid.place(s)}')
    if msg.terminated != bool(world.terminal[s]):
        return Rejected('wrong end', 'terminated must be true at a goal and nowhere else, '
                       f'got {msg.terminated} in state {s}')
    limit = world.grid.step_limit
    if msg.step > limit or msg.truncated != (msg.step == limit and not msg.terminated):
        return Rejected('wrong step', f'an episode must be truncated at step {limit} and nowhere '
                       f'else, got {msg.truncated} at step {msg.step}')
    if msg.step == 0 and not (world.begins[s] and msg.reward == 0.0):
        return Rejected('wrong start', 'an episode must begin in one of the starts with reward 0, '
                       f'got reward {msg.reward} in state {s}')
    return None


def validate_recommendation(msg, world):
    """`Rejected` for a `Recommendation` that cannot be right in this world, or None."""
    states = len(world.terminal)
    if not 0 <= msg.state < states:
        return Rejected('advice outside the grid', 'a recommendation must be for a state in '
                       f'[0, {states - 1}], got {msg.state}')
    takes = world.free[msg.state]  # elsewhere advice is idle, whatever it is
    if takes and msg.action != NO_ACTION and not (
            0 <= msg.action < 4 and world.available[msg.state, msg.action]):
        return Rejected('advice not available', 'a recommendation must be an action that the cell '
                       f'has, or {NO_ACTION}, got {msg.action} in state {msg.state}')
    return None


def validate_confidence(msg):
    """`Rejected` for an `Action` whose confidence is no probability, or None."""
    if 0.0 <= msg.confidence <= 1.0:
        return None
    return Rejected('confidence not a probability',
                   f'a confidence must lie in [0, 1], got {msg.confidence}')


def validate_same_world(msg, here):
    """`Rejected` for a run that turns into another world, or nothing, as a tuple."""
    if msg.sha256 == here.sha256:
        return ()
    return (Rejected('another world', f'the world of run {here.run} must stay {here.name!r}, '
                    f'got {msg.name[:LONGEST_NAME]!r}'),)


def rejected_description(error):
    """`Rejected` for a `WorldDescription` that cannot be a world."""
    return Rejected('not a world', f'a world must be whole: {error}')


def rejected_run(msg, run, topic):
    """`Rejected` for a message of another run."""
    return Rejected('another run', f'{topic} must belong to run {run} of the world here, '
                   f'got run {msg.run}')
