# SPDX-License-Identifier: Apache-2.0
"""`scripts/chaos`: kills nodes at random moments, and proves that nothing is lost."""

import argparse
from collections import Counter
from contextlib import contextmanager
from itertools import count
from pathlib import Path
import random
import sys
from threading import Event, Thread
import time

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.nodes.lesson import lesson_parser, NODES, run_lesson
from comply_ros.nodes.node_processes import NodeDied
from comply_ros.nodes.run_monitor import LessonFailed
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.storage.mentor_cache import mentor_policy
from comply_ros.terminal.console import console
from comply_ros.terminal.training_options import check_options, guarded, MISTAKES
from comply_ros.world.mdp import World

# One lesson after the other until there were enough kills: each kind of memory that can be lost.
LESSONS = (
    ('--method', 'beta_implicit', '--mentor', 'noisy:0.3'),
    ('--method', 'explicit_lambda', '--mentor', 'noisy:0.3', '--budget', '40'),
    ('--method', 'head_start', '--mentor', 'random@0.8'),
    ('--method', 'vanishing', '--mentor', 'noisy:0.3', '--budget', '40', '--advising', 'mistakes'),
    ('--method', 'watkins', '--mentor', 'none'),
)
LESSON = ('--map', 'bar_grid', '--iterations', '3', '--respawn')
LONGEST = 2.4  # seconds between two kills, at most: a node needs about half a second to start


class Killer:
    """
    Kills the nodes of one lesson after the other, as a seed says.

    Parameters
    ----------
    most: kills in all.
    seed: of the moments and of who is killed.
    end: when to stop, in seconds of the monotonic clock.

    Attributes
    ----------
    killed: how often each node was killed.

    """

    def __init__(self, most, seed, end):
        self.killed, self._most, self._end = Counter(), most, end
        self._random = random.Random(seed)

    def has_done(self):
        """Tell whether there were enough kills, or the time is up."""
        return self.killed.total() >= self._most or time.monotonic() > self._end

    @contextmanager
    def disturbing(self, processes):
        """Kill these nodes while the block runs."""
        over = Event()
        thread = Thread(target=self._kill, args=(processes, over))
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _kill(self, processes, over):
        begin = time.monotonic()
        while not self.has_done() and not over.wait(self._random.uniform(0.0, LONGEST)):
            victim = self._random.choice(processes)
            if victim.kill():
                self.killed[victim.name] += 1
                console.print(f'  {time.monotonic() - begin:6.2f} s  kill -9 {victim.name}')


def main(argv):
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser('chaos', description='Kill nodes at random moments while '
                                     'they learn, and compare what they learned.')
    add = parser.add_argument
    add('--kills', type=int, default=100, metavar='N', help='(default: %(default)s)')
    add('--seed', type=int, default=0, metavar='K', help='of the moments (default: %(default)s)')
    add('--seconds', type=float, default=float('inf'), metavar='T',
        help='begin no further kill after this time (default: no limit)')
    add('--out', default='runs/chaos', metavar='DIR', help='(default: %(default)s)')
    given = parser.parse_args(argv[1:])
    use_kernel_cache()
    return guarded('chaos', MISTAKES, lambda: run(given))


def run(given):
    """Hold lessons until there were enough kills; return 0 if no digest differed, else 1."""
    if not 0 <= given.seed <= SEED_LIMIT or given.kills < 1:
        raise ConfigError(f'seed must lie in [0, {SEED_LIMIT}] and kills be at least 1, '
                          f'got {given.seed} and {given.kills}')
    killer = Killer(given.kills, given.seed, time.monotonic() + given.seconds)
    lessons = held = 0
    for number in count():
        if killer.has_done():
            break
        lessons, held = lessons + 1, held + survives(number, given, killer)
    told = ', '.join(f'{name} {killer.killed[name]}' for name in NODES)
    console.print(f'{killer.killed.total()} kills ({told}): the digest held in {held} of '
                  f'{lessons} lessons')
    return 0 if held == lessons else 1


def survives(number, given, killer):
    """Return whether a lesson under kills gives the digest of an undisturbed one; tell it."""
    argv = (*LESSONS[number % len(LESSONS)], *LESSON, '--seed', str(given.seed + number), '--out',
            str(Path(given.out) / f'{number + 1}'))
    options = check_options(lesson_parser().parse_args(argv))
    expected, before = digest_in_process(options), killer.killed.total()
    console.print(f'lesson {number + 1}: {" ".join(argv[:-2])}')
    try:
        _, _, outcome = run_lesson(options, killer.disturbing)
    except (NodeDied, LessonFailed) as failure:
        console.print(f'  failed: {failure}')
        return False
    same = outcome['digest'] == expected
    console.print(f'  {killer.killed.total() - before} kills, {outcome["steps"]:,} steps, digest '
                  f'{outcome["digest"][:16]}: {"held" if same else f"is not {expected[:16]}"}')
    return same


def digest_in_process(options):
    """Digest of the same lesson in one process, undisturbed."""
    world = World(options.grid)
    policy = mentor_policy(options.spec, world, options.mentor_seed)
    training = Training(world, AdviceBudget(world, policy, options.budget, options.advising),
                        options.config, options.seed)
    while training.iterations_done < options.config.iterations:
        training.iterate()
    return training.state.digest()


if __name__ == '__main__':
    sys.exit(main(sys.argv))
