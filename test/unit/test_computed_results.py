# SPDX-License-Identifier: Apache-2.0
"""What is read from computed runs: the ends of learners that teach each other, by hand."""

import numpy as np

from comply_ros.experiments.computed_results import EndsTogether, Results
from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.training_runs import PairCurves, Run, RunResult

SEEDS = 5  # two pairs, and one whose partner is left out


def test_a_pair_ends_better_where_both_do_over_the_last_fifty_iterations(tmp_path):
    run = Run('bar_grid', method='pi_reuse', settings=(('measuring_iterations', 1),))
    cells = ResultCache(tmp_path, SEEDS)
    start = [100.0] + 10 * [-7.0]  # an iteration that only measures, and others before the end
    alone = [start + 50 * [value] for value in (1.0, 1.0, 1.0, 1.0, 1.0)]
    together = [start + 50 * [value] for value in (2.0, 3.0, 4.0, 1.0, 5.0)]
    cells.save(run, [RunResult(each, [], [], np.zeros(1, dtype=bool), np.zeros(1), 0, '')
                     for each in alone])
    cells.save_extra('together', run, PairCurves(together))
    assert cells.has_extra('together', run)
    assert not ResultCache(tmp_path, SEEDS + 1).has_extra('together', run)
    assert Results(cells, 'published').ends_together(run) == EndsTogether(3.0, 1.0, 1, 2)
