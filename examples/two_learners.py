# SPDX-License-Identifier: Apache-2.0
"""Two learners that teach each other in `maze`, beside two that learn alone."""

from dataclasses import replace
import sys

import comply_ros
from comply_ros.learner.presets import find_method
from comply_ros.learner.two_learners import TwoLearners
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

LAST = 50  # iterations that count as the end


def main(method: str = 'pi_reuse', iterations: int = 400, seeds: tuple[int, int] = (0, 1)) -> None:
    """Print the mean return of the last iterations of each learner, together and alone."""
    use_kernel_cache()
    config = replace(find_method(method, 'published'), iterations=iterations)
    pair = TwoLearners(World(read_map('maze', 'published')), config, seeds)
    together = list(zip(*(pair.iterate() for _ in range(iterations))))
    for seed, results in zip(seeds, together):
        alone = comply_ros.train('maze', method, 'none', seed=seed, iterations=iterations)
        end = sum(each.mean_return for each in results[-LAST:]) / len(results[-LAST:])
        print(f'seed {seed}: alone {alone.returns[-LAST:].mean():.2f}, '
              f'with the other one {end:.2f}')


if __name__ == '__main__':
    main(*sys.argv[1:2])
