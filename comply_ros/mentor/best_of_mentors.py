# SPDX-License-Identifier: Apache-2.0
"""What several mentors are worth: each alone, and the best of them in each state."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.mentor_spec import MentorSpec
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import policy_probabilities, policy_values
from comply_ros.world.reference_returns import AnyReturns


def mentor_returns(spec: MentorSpec, reference: AnyReturns,
                   advice: NDArray[Any]) -> dict[str, float | None]:
    """
    Return the exact expected return of each mentor's policy by its name.

    None in a world without a model.

    spec: of one mentor or several. advice: `advice[m * n_states + s]`.
    """
    names = spec.by_name()
    return {name: reference.return_of(row)
            for name, row in zip(names, advice.reshape(len(names), -1))}


def best_of_mentors(world: World, advice: NDArray[Any]) -> NDArray[Any]:
    """
    `policy[s]` of whoever follows, in each state, the mentor that is worth most there.

    The mentor m with the highest exact value V_m(s) of its own policy, the first of several; -1
    where none of them has advice. Its values are at least the maximum over the mentors in every
    state: the policy of Cheng, Kolobov and Agarwal, MAMBA (NeurIPS 2020).

    advice: `advice[m * n_states + s]`, -1 for none.
    """
    rows = advice.reshape(-1, world.n_states)
    values = np.array([policy_values(world, policy_probabilities(world, row)) for row in rows])
    values = np.where(rows != NO_ACTION, values, -np.inf)
    chosen = values.argmax(axis=0)
    return rows[chosen, np.arange(world.n_states)]
