# SPDX-License-Identifier: Apache-2.0
"""`train`: world, mentor and learner in one process, with the bits of the three nodes."""

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from comply_ros.experiments.parallel_runs import completed, local_executor
from comply_ros.experiments.train_api import train_seed
from comply_ros.learner.agent import IterationResult
from comply_ros.learner.learner_config import ConfigError
from comply_ros.storage.learning_file import save_learning
from comply_ros.storage.mentor_cache import is_slow, mentor_policy
from comply_ros.terminal.command_line import whole_number
from comply_ros.terminal.console import iteration_status, progress_bar
from comply_ros.terminal.interrupts import check, interrupts, StopFlag
from comply_ros.terminal.run_report import plot_process, report_training
from comply_ros.terminal.training_options import main_with, training_parser, TrainingOptions
from comply_ros.world.mdp import World
from comply_ros.world.reference_returns import reference_returns


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    parser = training_parser('train', 'Learn in one process: the same bits as the nodes, faster.')
    parser.add_argument('--seeds', type=whole_number, default=1, metavar='N',
                        help='repeat with the seeds K to K+N-1, in parallel (default: 1)')
    return main_with(parser, run, argv)


def run(options: TrainingOptions) -> int:
    """Train with every seed, write the results, return the exit code."""
    count = options.args.seeds
    if count < 1:
        raise ConfigError(f'seeds must be at least 1, got {count}')
    with plot_process() as plot:
        world = World(options.source)
        reference = reference_returns(world)  # before the training: it finds maps without end
        with interrupts() as stop, progress_bar() as bar:
            advice = _advice(options, world, bar, stop)
            task = bar.add_task(options.method, total=count * options.config.iterations, now='')

            def show(iteration: IterationResult) -> None:
                now = iteration_status(iteration.mean_return, iteration.confidence) \
                    if count == 1 else ''
                bar.update(task, advance=1, now=now)

            def train(seed: int, stop: StopFlag) -> dict[str, Any] | None:
                result = train_seed(options, reference, advice, seed, show, stop)
                if result and seed == options.seed:
                    save_learning(options.out / 'learning.npz', result.learned)
                return result and result.outcome()
            seeds = range(options.seed, options.seed + count)
            with local_executor(train, stop) as executor:
                results = dict(completed(executor, zip(seeds, seeds), stop))
        report_training(options, options.out, reference, advice,
                        [results[seed] for seed in seeds], plot)
    return 0


def _advice(options: TrainingOptions, world: World, bar: Any, stop: StopFlag
            ) -> NDArray[Any]:
    """Return `advice[s]`; a mentor that takes long to generate has its own progress bar."""
    if not is_slow(options.spec, world, options.mentor_seed):
        return mentor_policy(options.spec, world, options.mentor_seed)
    task = bar.add_task(f'mentor {options.mentor}', total=100, now='generated once')

    def show(share: float) -> None:
        check(stop)
        bar.update(task, completed=round(100 * share))
    advice = mentor_policy(options.spec, world, options.mentor_seed, show)
    bar.update(task, completed=100)
    return advice
