# SPDX-License-Identifier: Apache-2.0
"""Runs of an experiment that are not in its cache yet: computed in parallel, saved one by one."""

from collections.abc import Collection, Sequence

from comply_ros.experiments import training_runs
from comply_ros.experiments.parallel_runs import completed, local_executor
from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.training_runs import Run, run_of_seed, RunResult
from comply_ros.terminal.console import progress_bar, progress_console
from comply_ros.terminal.interrupts import StopFlag


def compute_cells(missing: Sequence[Run], cache: ResultCache, stop: StopFlag,
                  watched: Collection[Run] = ()) -> None:
    """
    Compute cells on all cores, and save each in the cache as soon as all its seeds are done.

    watched: those of them with the changes of their values.

    Raises
    ------
    KeyboardInterrupt: if `stop` is set; what was computed is kept.

    """
    results: dict[Run, dict[int, RunResult]] = {run: {} for run in missing}

    def learn(job: tuple[Run, int], stop: StopFlag) -> RunResult | None:
        run, seed = job
        return training_runs.learn(run_of_seed(run, seed), stop, run in watched)
    jobs = ((run, seed) for run in missing for seed in range(cache.seeds))
    try:
        with progress_bar() as bar, local_executor(learn, stop) as executor:
            task = bar.add_task('learning', total=len(missing) * cache.seeds, now='')
            for (run, seed), result in completed(executor, ((job, job) for job in jobs), stop):
                results[run][seed] = result
                if len(results[run]) == cache.seeds:
                    by_seed = results.pop(run)
                    cache.save(run, [by_seed[seed] for seed in range(cache.seeds)])
                bar.update(task, advance=1, now=run.method)
    except BaseException:
        done = sum(map(cache.has, missing))
        progress_console.print(f'{done} of {len(missing)} cells were computed and are kept in '
                               f'{cache.folder}; the same command continues from there')
        raise
