# SPDX-License-Identifier: Apache-2.0
"""What is read from computed runs: ends of learners and around an exchange, by hand."""

import numpy as np

from comply_ros.experiments.computed_results import (
    EndsTogether,
    exchange_ends,
    ExchangeEnds,
    Results,
)
from comply_ros.experiments.extra_curves import ExchangeCurves, PairCurves
from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.training_runs import Run, RunResult

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


def test_an_exchange_has_means_of_twenty_iterations_before_and_after_it_and_at_the_end():
    values = np.array([[9.0] + 20 * [1.0] + 20 * [2.0] + 5 * [7.0] + 20 * [4.0],
                       [9.0] + 20 * [3.0] + 20 * [6.0] + 5 * [7.0] + 20 * [8.0]])
    assert exchange_ends(values, exchanged=21) == ExchangeEnds(2.0, 4.0, 6.0)


def test_the_iterations_that_only_measure_are_no_part_of_an_exchange(tmp_path):
    run = Run('bar_grid', method='explicit', settings=(('measuring_iterations', 2),),
              mentor='optimal + random')
    cells = ResultCache(tmp_path, 1)
    cells.save_extra('exchange', run, ExchangeCurves(
        np.array([[9.0, 9.0, 1.0, 2.0]]), np.array([[0.9, 0.9, 0.1, 0.2]]), 3))
    curves = Results(cells, 'published').exchange(run)
    assert (curves.returns.tolist(), curves.confidences.tolist()) == ([[1.0, 2.0]], [[0.1, 0.2]])
    assert curves.exchanged == 1  # the iteration with the return 2 is the first of the second one
