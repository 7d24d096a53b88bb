# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report are drawn in another process, or in this one."""

import gc
import os

import numpy as np
from numpy import nan
import pytest

from comply_ros.terminal.run_report import mean_confidences, plot_here, plot_process

SUMMARY = {'optimal_return': 1.0, 'mentor_return': None, 'episodes': 2, 'method': 'sarsa',
           'map': 'maze', 'mentor': 'none'}


def children():
    """Return the process ids of the children of this process."""
    with open(f'/proc/{os.getpid()}/task/{os.getpid()}/children') as file:
        return set(file.read().split())


def test_a_picture_is_drawn_by_another_process_that_then_ends(tmp_path):
    before = children()
    with plot_process() as plot:
        done = plot('draw_learning_curve', tmp_path / 'a.png', np.zeros((1, 5)), SUMMARY)
        assert len(children() - before) == 1
        done.result()
    assert (tmp_path / 'a.png').read_bytes()[:4] == b'\x89PNG'
    assert children() <= before


def test_an_error_in_the_other_process_is_raised_here(tmp_path):
    with plot_process() as plot, pytest.raises(FileNotFoundError):
        plot('draw_learning_curve', tmp_path / 'no' / 'a.png', np.zeros((1, 5)), SUMMARY).result()


def test_a_process_with_threads_draws_itself(tmp_path):
    before = children()
    done = plot_here('draw_learning_curve', tmp_path / 'a.png', np.zeros((1, 5)), SUMMARY)
    assert done.done() and (tmp_path / 'a.png').exists()
    assert children() == before


class Unfinished:
    """Says in a file which process deletes it; it is garbage as soon as it is made."""

    def __init__(self, path):
        self.itself, self.path = self, path

    def __del__(self):
        with open(self.path, 'a') as file:
            file.write(f'{os.getpid()}\n')


def test_the_other_process_does_not_delete_the_garbage_of_this_one(tmp_path, monkeypatch):
    monkeypatch.setattr('comply_ros.terminal.run_report.PLOTS', 'gc')  # its functions are called
    Unfinished(tmp_path / 'deleted')
    with plot_process() as plot:
        plot('collect').result()
        assert not (tmp_path / 'deleted').exists()
    gc.collect()
    assert (tmp_path / 'deleted').read_text() == f'{os.getpid()}\n'


def test_the_confidence_in_each_mentor_is_the_mean_of_the_seeds_that_know_it():
    curves = mean_confidences([{'anna': [0.5, nan, nan], 'bob': [nan, nan, nan]},
                               {'anna': [1.0, 0.25, nan], 'bob': [nan, nan, nan]}])
    assert list(curves) == ['anna', 'bob']  # each keeps its color
    iterations, means = curves['anna']
    assert list(iterations) == [1, 2, 3]
    np.testing.assert_array_equal(means, [0.75, 0.25, nan])


def test_there_is_no_confidence_where_no_seed_knows_any():
    assert mean_confidences([{'': [nan, nan]}]) == {}
