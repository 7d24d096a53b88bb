# SPDX-License-Identifier: Apache-2.0
"""`train`: the same learning in one process, for one seed or for many in parallel."""

from concurrent.futures import as_completed, ThreadPoolExecutor
import os
import time

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.storage.mentor_cache import is_slow, mentor_policy
from comply_ros.storage.run_files import save_learning
from comply_ros.terminal.console import iteration_status, progress_bar
from comply_ros.terminal.interrupts import check, interrupts
from comply_ros.terminal.run_report import plot_process, report_training
from comply_ros.terminal.training_options import main_with, training_parser
from comply_ros.world.mdp import World
from comply_ros.world.planning import ReferenceReturns


def main(argv):
    """Run the command; return the exit code."""
    parser = training_parser('train', 'Learn in one process: the same bits as the nodes, faster.')
    parser.add_argument('--seeds', type=int, default=1, metavar='N',
                        help='repeat with the seeds K to K+N-1, in parallel (default: 1)')
    return main_with(parser, run, argv)


def run(options):
    """Train for every seed, write the results, return the exit code."""
    count = options.args.seeds
    if count < 1:
        raise ConfigError(f'seeds must be at least 1, got {count}')
    with plot_process() as plot:
        return train(options, count, plot)


def train(options, count, plot):
    """Train with that many seeds, write the results, return the exit code."""
    world = World(options.grid)
    reference = ReferenceReturns(world)  # before the learning: it finds maps without end
    with interrupts() as stop, progress_bar() as bar:
        advice = make_mentor(options, world, bar, stop)
        task = bar.add_task(options.method, total=count * options.config.iterations, now='')

        def tell(iteration):
            bar.update(task, advance=1, now=iteration_status(
                iteration.mean_return, iteration.confidence) if count == 1 else '')
        outcomes = train_all(options, world, advice, range(options.seed, options.seed + count),
                             tell, stop)
    report_training(options, reference, advice, outcomes, plot)
    return 0


def make_mentor(options, world, bar, stop):
    """Return `advice[s]`; a mentor that takes long to make has a progress bar of its own."""
    if not is_slow(options.spec, world, options.mentor_seed):
        return mentor_policy(options.spec, world, options.mentor_seed)
    task = bar.add_task(f'mentor {options.mentor}', total=100, now='generated once')

    def tell(share):
        check(stop)
        bar.update(task, completed=round(100 * share))
    advice = mentor_policy(options.spec, world, options.mentor_seed, tell)
    bar.update(task, completed=100)
    return advice


def train_all(options, world, advice, seeds, tell, stop):
    """Outcomes of all seeds, in their order; the compiled loops run on all cores at once."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [pool.submit(train_one, options, world, advice, seed, tell, stop) for seed in seeds]
        try:
            for job in as_completed(jobs):
                job.result()
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise
    check(stop)
    return [job.result() for job in jobs]


def train_one(options, world, advice, seed, tell, stop):
    """
    Return the outcome of one seed; tell is called with every `IterationResult`.

    What the first seed of the session learned is written to `learning.npz`. An `Stop` that is
    set stops it after the iteration, without an outcome.
    """
    mentor = AdviceBudget(world, advice, options.budget, options.advising)
    training = Training(world, mentor, options.config, seed)
    begin, returns, steps = time.perf_counter(), [], 0
    for _ in range(options.config.iterations):
        iteration = training.iterate()
        returns.append(iteration.mean_return)
        steps += iteration.steps
        tell(iteration)
        if stop.is_set():
            return None
    seconds = time.perf_counter() - begin
    if seed == options.seed:
        save_learning(options.out / 'learning.npz', options.config, training.memory,
                      advice.tolist())
    return {'seed': seed, 'returns': returns, 'steps': steps, 'wall_seconds': seconds,
            'digest': training.memory.digest()}
