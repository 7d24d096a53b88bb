# SPDX-License-Identifier: Apache-2.0
"""What cannot be right in a world, and is refused: one sentence for each way to be wrong."""

from math import isfinite

from comply_ros.core.dialogue import LONGEST_NAME, Refused
from comply_ros.core.grid import NO_ACTION


def problem_of_state(said, world):
    """`Refused` for a `StateReward` that cannot be right in this world, or None."""
    s, states = said.state, len(world.terminal)
    if not 0 <= s < states:
        return Refused('state outside the grid',
                       f'a state must lie in [0, {states - 1}], got {s}')
    if not isfinite(said.reward):
        return Refused('reward not a number',
                       f'a reward must be a finite number, got {said.reward}')
    if world.obstacle[s]:
        return Refused('state in an obstacle', 'a state must not be an obstacle, '
                       f'got {s} at {world.grid.place(s)}')
    if said.terminated != bool(world.terminal[s]):
        return Refused('wrong end', 'terminated must be true at a goal and nowhere else, '
                       f'got {said.terminated} in state {s}')
    limit = world.grid.step_limit
    if said.step > limit or said.truncated != (said.step == limit and not said.terminated):
        return Refused('wrong step', f'an episode must be truncated at step {limit} and nowhere '
                       f'else, got {said.truncated} at step {said.step}')
    if said.step == 0 and not (world.begins[s] and said.reward == 0.0):
        return Refused('wrong start', 'an episode must begin in one of the starts with reward 0, '
                       f'got reward {said.reward} in state {s}')
    return None


def problem_of_advice(said, world):
    """`Refused` for a `Recommendation` that cannot be right in this world, or None."""
    states = len(world.terminal)
    if not 0 <= said.state < states:
        return Refused('advice outside the grid', 'a recommendation must be for a state in '
                       f'[0, {states - 1}], got {said.state}')
    takes = world.free[said.state]  # elsewhere advice is idle, whatever it is
    if takes and said.action != NO_ACTION and not (
            0 <= said.action < 4 and world.available[said.state, said.action]):
        return Refused('advice not available', 'a recommendation must be an action that the cell '
                       f'has, or {NO_ACTION}, got {said.action} in state {said.state}')
    return None


def problem_of_confidence(said):
    """`Refused` for an `Action` whose confidence is no probability, or None."""
    if 0.0 <= said.confidence <= 1.0:
        return None
    return Refused('confidence not a probability',
                   f'a confidence must lie in [0, 1], got {said.confidence}')


def problem_of_world(said, here):
    """`Refused` for a run that turns into another world, or nothing, as a tuple."""
    if said.sha256 == here.sha256:
        return ()
    return (Refused('another world', f'the world of run {here.run} must stay {here.name!r}, '
                    f'got {said.name[:LONGEST_NAME]!r}'),)


def problem_of_description(error):
    """`Refused` for a `WorldDescription` that cannot be a world."""
    return Refused('not a world', f'a world must be whole: {error}')


def problem_of_run(said, run, topic):
    """`Refused` for a message of another run."""
    return Refused('another run', f'{topic} must belong to run {run} of the world here, '
                   f'got run {said.run}')
