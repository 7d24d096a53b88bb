# SPDX-License-Identifier: Apache-2.0
"""Cells on disk: saved whole, and found again for the same run only."""

import numpy as np
import pytest

from comply_ros.experiments import result_cache, training_runs
from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.training_runs import Run

RUN = Run('bar_grid', settings=(('iterations', 2), ('episodes', 3)), mentor='optimal')


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the cell of `RUN` for two seeds."""
    results = [training_runs.learn(RUN._replace(seed=seed)) for seed in (0, 1)]
    ResultCache(tmp_path, 2).save(RUN, results)
    return tmp_path


def test_a_saved_cell_is_loaded_again(folder):
    cell = ResultCache(folder, 2).load(RUN)
    assert cell.returns.tolist() == [training_runs.learn(RUN._replace(seed=seed)).returns
                                     for seed in (0, 1)]
    assert np.array_equal(cell.q, training_runs.learn(RUN).q)


def test_a_cell_has_fewer_seeds_but_not_more(folder):
    assert ResultCache(folder, 1).load(RUN).returns.shape == (1, 2)
    assert not ResultCache(folder, 3).has(RUN)
    with pytest.raises(KeyError):
        ResultCache(folder, 3).load(RUN)


@pytest.mark.parametrize('change', [
    {'map': 'free_grid'}, {'profile': 'report'}, {'method': 'explicit'}, {'mentor': 'random'},
    {'settings': ()}, {'budget': 3}, {'mentor_seed': 1}])
def test_another_run_is_another_cell(folder, change):
    assert ResultCache(folder, 2).has(RUN)
    assert not ResultCache(folder, 2).has(RUN._replace(**change))


def test_two_later_fields_with_the_same_value_are_two_cells(folder):
    run = RUN._replace(method='model_based')
    changed = [run._replace(settings=(*run.settings, (name, 0.0)))
               for name in ('untried_value', 'advice_slack')]
    cache = ResultCache(folder, 1)
    cache.save(changed[0], [training_runs.learn(RUN)])
    assert [cache.has(each) for each in changed] == [True, False]


@pytest.mark.parametrize('name', ['FORMAT_VERSION', 'ALGORITHM_VERSION'])
def test_a_cell_of_another_version_does_not_count(folder, monkeypatch, name):
    monkeypatch.setattr(result_cache, name, 99)
    assert not ResultCache(folder, 2).has(RUN)


def test_a_cell_belongs_to_the_text_of_a_mentor_file(tmp_path):
    one, other = tmp_path / 'a.txt', tmp_path / 'b.txt'
    one.write_text('same')
    other.write_text('same')
    cache = ResultCache(tmp_path, 1)
    cache.save(RUN._replace(mentor=f'file:{one}'), [training_runs.learn(RUN)])
    assert cache.has(RUN._replace(mentor=f'file:{other}'))
    other.write_text('another')
    assert not cache.has(RUN._replace(mentor=f'file:{other}'))


def test_a_cut_off_file_is_no_cell(folder):
    path, = folder.glob('*.npz')
    path.write_bytes(path.read_bytes()[:100])
    assert not ResultCache(folder, 2).has(RUN)


def test_a_file_with_changed_bytes_is_no_cell(folder):
    path, = folder.glob('*.npz')
    content = bytearray(path.read_bytes())
    content[200:900] = bytes(255 - byte for byte in content[200:900])
    path.write_bytes(content)
    assert not ResultCache(folder, 2).has(RUN)


def test_a_cell_belongs_to_the_content_of_a_map_file(folder, tmp_path):
    runs = []
    for name, limit in (('a', 50), ('b', 50), ('c', 60)):
        path = tmp_path / name / 'mine.yaml'
        path.parent.mkdir()
        path.write_text(f'extends: bar_grid\nstep_limit: {limit}\n')
        runs.append(RUN._replace(map=str(path)))
    ResultCache(folder, 1).save(runs[0], [training_runs.learn(runs[0])])
    assert [ResultCache(folder, 1).has(run) for run in runs] == [True, True, False]


def test_a_cell_without_changes_is_not_a_watched_one(folder):
    assert not ResultCache(folder, 2).has(RUN, watched=True)
    ResultCache(folder, 1).save(RUN, [training_runs.learn(RUN, watches_values=True)])
    assert ResultCache(folder, 1).has(RUN, watched=True)


def test_an_error_names_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / 'data').write_text('in the way')
    with pytest.raises(OSError) as error:
        ResultCache(tmp_path / 'data', 1).save(RUN, [training_runs.learn(RUN)])
    assert str(tmp_path / 'data') in str(error.value)
