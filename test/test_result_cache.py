# SPDX-License-Identifier: Apache-2.0
"""Cells on disk: kept whole, found again, and only for what they are."""

import numpy as np
import pytest

from comply_ros.experiments import result_cache, training_runs
from comply_ros.experiments.result_cache import Cells
from comply_ros.experiments.training_runs import Run

RUN = Run('bar_grid', settings=(('iterations', 2), ('episodes', 3)), mentor='optimal')


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the cell of `RUN` for two seeds."""
    Cells(tmp_path, 2).save(RUN, [training_runs.learn(RUN._replace(seed=seed)) for seed in (0, 1)])
    return tmp_path


def test_what_is_saved_is_found_again(folder):
    cell = Cells(folder, 2).load(RUN)
    assert cell.returns.tolist() == [training_runs.learn(RUN._replace(seed=seed)).returns
                                     for seed in (0, 1)]
    assert np.array_equal(cell.q, training_runs.learn(RUN).q)


def test_fewer_seeds_are_a_part_and_more_are_missing(folder):
    assert Cells(folder, 1).load(RUN).returns.shape == (1, 2)
    assert not Cells(folder, 3).has(RUN)
    with pytest.raises(KeyError):
        Cells(folder, 3).load(RUN)


@pytest.mark.parametrize('change', [
    {'map': 'free_grid'}, {'profile': 'report'}, {'method': 'explicit'}, {'mentor': 'random'},
    {'settings': ()}, {'budget': 3}, {'mentor_seed': 1}])
def test_another_run_is_another_cell(folder, change):
    assert Cells(folder, 2).has(RUN)
    assert not Cells(folder, 2).has(RUN._replace(**change))


@pytest.mark.parametrize('name', ['FORMAT_VERSION', 'ALGORITHM_VERSION'])
def test_a_cell_of_another_version_does_not_count(folder, monkeypatch, name):
    monkeypatch.setattr(result_cache, name, 99)
    assert not Cells(folder, 2).has(RUN)


def test_a_mentor_from_a_file_counts_by_its_text(tmp_path):
    one, other = tmp_path / 'a.txt', tmp_path / 'b.txt'
    one.write_text('same')
    other.write_text('same')
    store = Cells(tmp_path, 1)
    store.save(RUN._replace(mentor=f'file:{one}'), [training_runs.learn(RUN)])
    assert store.has(RUN._replace(mentor=f'file:{other}'))
    other.write_text('another')
    assert not store.has(RUN._replace(mentor=f'file:{other}'))


def test_a_spoiled_file_is_computed_again(folder):
    path, = folder.glob('*.npz')
    path.write_bytes(path.read_bytes()[:100])
    assert not Cells(folder, 2).has(RUN)


def test_bytes_that_were_changed_are_noticed(folder):
    path, = folder.glob('*.npz')
    content = bytearray(path.read_bytes())
    content[200:900] = bytes(255 - byte for byte in content[200:900])
    path.write_bytes(content)
    assert not Cells(folder, 2).has(RUN)


def test_a_map_counts_by_what_it_holds(folder, tmp_path):
    text = 'extends: bar_grid\nstep_limit: {}\n'
    (tmp_path / 'mine.yaml').write_text(text.format(50))
    run = RUN._replace(map=str(tmp_path / 'mine.yaml'))
    Cells(folder, 1).save(run, [training_runs.learn(run)])
    assert Cells(folder, 1).has(run)
    (tmp_path / 'mine.yaml').write_text(text.format(60))
    training_runs._yardstick.cache_clear()
    assert not Cells(folder, 1).has(run)


def test_a_cell_that_was_not_watched_lacks_its_changes(folder):
    assert not Cells(folder, 2).has(RUN, watched=True)
    Cells(folder, 1).save(RUN, [training_runs.learn(RUN, watches_values=True)])
    assert Cells(folder, 1).has(RUN, watched=True)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / 'data').write_text('in the way')
    with pytest.raises(OSError) as error:
        Cells(tmp_path / 'data', 1).save(RUN, [training_runs.learn(RUN)])
    assert str(tmp_path / 'data') in str(error.value)
