# SPDX-License-Identifier: Apache-2.0
"""Expected returns of the optimal and the random policy and of mentors, if a world has a model."""

from comply_ros.world.mdp import World
from comply_ros.world.planning import Policy, ReferenceReturns


class UnknownReturns:
    """
    `ReferenceReturns` of a world without a model: none of them is known.

    Attributes
    ----------
    world: the `World`.
    optimal_return, random_return: None.

    """

    optimal_return: None = None
    random_return: None = None

    def __init__(self, world: World) -> None:
        self.world = world

    def return_of(self, policy: Policy) -> None:
        """Return None: the expected return of a policy is not known."""

    def optimality(self, policy_return: float | None) -> None:
        """Return None, as there is nothing to compare with."""


AnyReturns = ReferenceReturns | UnknownReturns


def reference_returns(world: World) -> AnyReturns:
    """
    Return what is known of the returns in a world.

    Raises
    ------
    PlanningError: for a world with a model whose optimum is not finite.

    """
    return UnknownReturns(world) if world.model == 'none' else ReferenceReturns(world)
