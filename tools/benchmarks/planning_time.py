# SPDX-License-Identifier: Apache-2.0
"""Value iteration in a large room, in a process of its own: it prints the seconds it took."""

import sys
import time

from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_values, TOLERANCE, value_iteration
from tools.benchmarks.sample_maps import room


def seconds_to_plan(side):
    """Seconds that the optimal values of a room take."""
    world = World(room(side))
    begin = time.perf_counter()
    optimal_values(world)
    return time.perf_counter() - begin


def estimate(side, smaller, sweeps):
    """
    Seconds that they would take: some sweeps are timed, and their number told from a smaller room.

    It grows with the side of the room.
    """
    needed = next(number for number, (_, change) in enumerate(
        value_iteration(World(room(smaller))), 1) if change < TOLERANCE) * side / smaller
    iteration = value_iteration(World(room(side)))
    next(iteration)
    begin = time.perf_counter()
    for _ in range(sweeps):
        next(iteration)
    return needed * (time.perf_counter() - begin) / sweeps


if __name__ == '__main__':
    use_kernel_cache()
    print(seconds_to_plan(int(sys.argv[1])))
