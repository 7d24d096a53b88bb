# SPDX-License-Identifier: Apache-2.0
"""Checks of single messages: what cannot be right is rejected, with one sentence for each rule."""

from math import isfinite

from comply_ros.protocol.messages import (
    Action,
    LONGEST_NAME,
    Outputs,
    Recommendation,
    Rejected,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.world_description import is_same_world
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


def validate_observation(msg: StateReward, world: World) -> Rejected | None:
    """Return why an observation cannot be right in this world, or None."""
    s, states = msg.state, world.n_states
    if not 0 <= s < states:
        return Rejected('state outside the world',
                        f'a state must lie in [0, {states - 1}], got {s}')
    if not isfinite(msg.reward):
        return Rejected('reward not a number',
                        f'a reward must be a finite number, got {msg.reward}')
    if world.obstacle[s]:
        return Rejected('state in an obstacle', 'a state must not be an obstacle, '
                        f'got {s} at {world.grid.place(s)}')
    if msg.terminated != bool(world.terminal[s]) and world.model != 'none':
        where = 'at a goal' if world.model == 'grid' else 'in a terminal state'
        return Rejected('wrong end', f'terminated must be true {where} and nowhere else, '
                        f'got {msg.terminated} in state {s}')
    limit = world.step_limit
    earlier = world.model == 'none' and msg.truncated and not msg.terminated
    if msg.step > limit or msg.truncated != (
            (msg.step == limit or earlier) and not msg.terminated):
        return Rejected('wrong step', f'an episode must be truncated at step {limit} and nowhere '
                        f'else, got {msg.truncated} at step {msg.step}')
    if world.model == 'none':
        return _validate_without_model(msg, world)
    if msg.step == 0 and not (world.begins[s] and msg.reward == 0.0):
        return Rejected('wrong start', 'an episode must start in one of the starts with reward 0, '
                        f'got reward {msg.reward} in state {s}')
    return None


def _validate_without_model(msg: StateReward, world: World) -> Rejected | None:
    if msg.step == 0 and (msg.reward != 0.0 or msg.terminated):
        return Rejected('wrong start', 'an episode must start with reward 0 and go on, '
                        f'got reward {msg.reward} and terminated {msg.terminated}')
    if not (msg.terminated or msg.truncated or world.free[msg.state]):
        return Rejected('no action', 'a state in which an episode goes on must have an action, '
                        f'got {msg.state}')
    return None


def validate_recommendation(msg: Recommendation, world: World) -> Rejected | None:
    """Return why a recommendation cannot be right in this world, or None."""
    states = world.n_states
    if not 0 <= msg.state < states:
        return Rejected('advice outside the world', 'a recommendation must be for a state in '
                        f'[0, {states - 1}], got {msg.state}')
    acts = world.free[msg.state]  # advice for other states is never used, so it may be anything
    if acts and msg.action != NO_ACTION and not (
            0 <= msg.action < world.n_actions and world.available[msg.state, msg.action]):
        return Rejected('advice not available', 'a recommendation must be an action that the '
                        f'state has, or {NO_ACTION}, got {msg.action} in state {msg.state}')
    return None


def validate_confidence(msg: Action) -> Rejected | None:
    """Return why the confidence of an action cannot be right, or None."""
    if 0.0 <= msg.confidence <= 1.0:
        return None
    return Rejected('confidence not a probability',
                    f'a confidence must lie in [0, 1], got {msg.confidence}')


def validate_same_world(msg: WorldDescription, current: WorldDescription) -> Outputs:
    """Return `Rejected`, as a tuple, for a run that turns into another world."""
    if is_same_world(msg, current):
        return ()
    return (Rejected('another world', f'the world of run {current.run} must stay '
                     f'{current.name!r}, got {msg.name[:LONGEST_NAME]!r}'),)


def rejected_description(error: ValueError) -> Rejected:
    """`Rejected` for a `WorldDescription` that does not describe a world."""
    return Rejected('not a world', f'a world must be complete: {error}')


def rejected_run(run: int, expected: int | None, topic: str) -> Rejected:
    """`Rejected` for a message of another run; topic: what it is, such as `a state`."""
    return Rejected('another run', f'{topic} must belong to run {expected} of the world here, '
                    f'got run {run}')
