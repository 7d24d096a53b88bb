# SPDX-License-Identifier: Apache-2.0
"""`scripts/chaos`: kill nodes at random moments, and check that nothing is lost."""

import argparse
from collections import Counter
from collections.abc import Generator, Sequence
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
from comply_ros.nodes.lesson import lesson_parser, run_lesson
from comply_ros.nodes.lesson_parameters import NODES
from comply_ros.nodes.node_processes import NodeDied, NodeProcess
from comply_ros.nodes.run_monitor import LessonFailed
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.mentor_cache import mentor_policy
from comply_ros.terminal.command_line import CommandParser, real_number, whole_number
from comply_ros.terminal.console import console, progress_console
from comply_ros.terminal.standard_output import standard_output
from comply_ros.terminal.training_options import (
    check_options,
    guarded,
    MISTAKES,
    TrainingOptions,
)
from comply_ros.world.mdp import World

# One lesson after the other until there were enough kills: each kind of state that can be lost.
LESSONS = (
    ('--method', 'beta_implicit', '--mentor', 'noisy:0.3'),
    ('--method', 'explicit_lambda', '--mentor', 'noisy:0.3', '--budget', '40'),
    ('--method', 'head_start', '--mentor', 'random@0.8'),
    ('--method', 'vanishing', '--mentor', 'noisy:0.3', '--budget', '40', '--advising', 'mistakes'),
    ('--method', 'watkins', '--mentor', 'none'),
)
COMMON = ('--map', 'bar_grid', '--iterations', '3', '--respawn')
LONGEST_PAUSE = 2.4  # seconds between two kills: a node needs about half a second to start
KILLS_PER_LESSON = 8  # then it is left to its end, which it may not reach on a busy machine


class NodeKiller:
    """
    Kills nodes of one lesson after the other, at moments that follow from a seed.

    Parameters
    ----------
    limit: kills in all.
    end: when to stop, in seconds of the monotonic clock.

    Attributes
    ----------
    kills: how often each node was killed.

    """

    def __init__(self, limit: int, seed: int, end: float) -> None:
        self.kills: Counter[str] = Counter()
        self._limit, self._end = limit, end
        self._random = random.Random(seed)

    def is_done(self) -> bool:
        """Tell whether there were enough kills, or the time is up."""
        return self.kills.total() >= self._limit or time.monotonic() > self._end

    @contextmanager
    def disturbing(self, processes: Sequence[NodeProcess]) -> Generator[None]:
        """Kill these nodes while the block runs."""
        over = Event()
        thread = Thread(target=self._kill, args=(processes, over))
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _kill(self, processes: Sequence[NodeProcess], over: Event) -> None:
        start = time.monotonic()
        last = self.kills.total() + KILLS_PER_LESSON
        while not self.is_done() and self.kills.total() < last and not over.wait(
                self._random.uniform(0.0, LONGEST_PAUSE)):
            process = self._random.choice(processes)
            if process.kill():
                self.kills[process.name] += 1
                progress_console.print(
                    f'  {time.monotonic() - start:6.2f} s  kill -9 {process.name}')


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    parser = CommandParser(
        'chaos', description='Kill nodes at random moments while they learn, and compare what '
        'they have learned with an undisturbed training.')
    add = parser.add_argument
    add('--kills', type=whole_number, default=100, metavar='N', help='(default: %(default)s)')
    add('--seed', type=whole_number, default=0, metavar='K',
        help='of the moments (default: %(default)s)')
    add('--seconds', type=real_number, default=float('inf'), metavar='T',
        help='start no kill after this time (default: no limit)')
    add('--out', default='runs/chaos', metavar='DIR', help='(default: %(default)s)')
    given = parser.parse_args(argv[1:])
    return guarded('chaos', MISTAKES, lambda: run(given))


def run(given: argparse.Namespace) -> int:
    """Run lessons until there were enough kills; return 0 if all digests are equal, else 1."""
    if not 0 <= given.seed <= SEED_LIMIT or given.kills < 1:
        raise ConfigError(f'seed must lie in [0, {SEED_LIMIT}] and kills be at least 1, '
                          f'got {given.seed} and {given.kills}')
    killer = NodeKiller(given.kills, given.seed, time.monotonic() + given.seconds)
    lessons = equal = 0
    for number in count():
        if killer.is_done():
            break
        lessons, equal = lessons + 1, equal + survives(number, given, killer)
    by_node = ', '.join(f'{name} {killer.kills[name]}' for name in NODES)
    console.print(f'{killer.kills.total()} kills ({by_node}): the digest was equal in {equal} of '
                  f'{lessons} lessons')
    return 0 if equal == lessons else 1


def survives(number: int, given: argparse.Namespace, killer: NodeKiller) -> bool:
    """Return whether a lesson with kills has the digest of an undisturbed one; print it."""
    argv = (*LESSONS[number % len(LESSONS)], *COMMON, '--seed', str(given.seed + number), '--out',
            str(Path(given.out) / f'{number + 1}'))
    options = check_options(lesson_parser().parse_args(argv))
    expected, before = digest_in_process(options), killer.kills.total()
    console.print(f'lesson {number + 1}: {" ".join(argv[:-2])}')
    try:
        outcome = run_lesson(options, killer.disturbing).outcome
    except (NodeDied, LessonFailed) as failure:
        console.print(f'  failed: {failure}')
        return False
    equal = outcome['digest'] == expected
    console.print(f'  {killer.kills.total() - before} kills, {outcome["steps"]:,} steps, digest '
                  f'{outcome["digest"][:16]}: '
                  f'{"equal" if equal else f"must be {expected[:16]}"}')
    return equal


def digest_in_process(options: TrainingOptions) -> str:
    """Digest of the same training in one process, undisturbed."""
    world = World(options.source)
    policy = mentor_policy(options.spec, world, options.mentor_seed)
    training = Training(world, AdviceBudget(world, policy, options.budget, options.advising),
                        options.config, options.seed, options.initial)
    while training.iterations_done < options.config.iterations:
        training.iterate()
    return training.state.digest()


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
