# SPDX-License-Identifier: Apache-2.0
"""Cells of an experiment on disk: one run repeated with many seeds, computed once."""

from dataclasses import astuple
import hashlib
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile
import zlib

import numpy as np

from comply_ros.experiments.training_runs import Growth, row_of, yardstick_of
from comply_ros.storage.file_system import atomic_write
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.storage.versions import ALGORITHM_VERSION, FORMAT_VERSION


class CellData(NamedTuple):
    """
    What came of one run with the seeds 0, 1, ...

    Attributes
    ----------
    returns: `returns[seed, iteration]`, mean of an episode.
    changes: `changes[seed, iteration]`, largest change of an action value; empty if not watched.
    steps: `steps[seed]`, actions taken.
    confidence, visited, q: of the learner with seed 0, by state.

    """

    returns: np.ndarray
    changes: np.ndarray
    steps: np.ndarray
    confidence: np.ndarray
    visited: np.ndarray
    q: np.ndarray


class Cells:
    """
    A folder of cells, each a file named by what was run and by the versions of what is stored.

    Parameters
    ----------
    folder: where the files are.
    seeds: how many seeds a cell must have.

    """

    def __init__(self, folder, seeds):
        self.folder, self.seeds, self._loaded = Path(folder), seeds, {}

    def has(self, run, watched=False):
        """Tell whether the cell is there, whole, with enough seeds, and watched if it must be."""
        cell = self._read(run)
        return cell is not None and (cell.changes.size > 0 or not watched)

    def load(self, run):
        """
        Return the `CellData` of a run.

        Raises
        ------
        KeyError: if it is not there.

        """
        cell = self._read(run)
        if cell is None:
            raise KeyError(run)
        return cell

    def save(self, run, learned):
        """
        Write a cell aside, then rename it; learned: `Learned` of the seeds 0, 1, ...

        Raises
        ------
        OSError: naming the file, if it cannot be written.

        """
        first = learned[0]
        cell = CellData(
            np.array([each.returns for each in learned]),
            np.array([each.changes for each in learned]),
            np.array([each.steps for each in learned]),
            np.array(first.confidence), first.visited, first.q)
        path = self._path(run)
        _write_whole(path, cell._asdict())
        self._loaded[path] = cell

    def has_growth(self, run):
        """Tell whether the growth of a learner is there."""
        return self._growth_path(run).exists()

    def save_growth(self, run, growth):
        """Write what `runs.growth` returns; raises OSError."""
        _write_whole(self._growth_path(run), growth._asdict())

    def load_growth(self, run):
        """Return the `Growth` that was saved; raises OSError."""
        with np.load(self._growth_path(run)) as file:
            return Growth(**{name: file[name] for name in file})

    def _growth_path(self, run):
        path = self._path(run)
        return path.with_name(f'growth-{path.name}')

    def _path(self, run):
        spec = read_mentor_spec(run.mentor)  # files count by what is in them, not by their names
        grid = yardstick_of(run).world.grid.sha256
        key = (grid, run.profile, run.method, astuple(row_of(run)), tuple(spec), run.mentor_seed,
               run.budget, run.advising, FORMAT_VERSION, ALGORITHM_VERSION)
        name = hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        return self.folder / f'{Path(run.map).stem}-{run.method}-{name}.npz'

    def _read(self, run):
        path = self._path(run)
        if path not in self._loaded:
            try:
                with np.load(path) as file:
                    self._loaded[path] = CellData(**{name: file[name] for name in file})
            except (OSError, EOFError, ValueError, KeyError, TypeError, BadZipFile, zlib.error):
                return None
        cell = self._loaded[path]
        if len(cell.returns) < self.seeds or not np.isfinite(cell.returns).all():
            return None
        return cell._replace(returns=cell.returns[:self.seeds], changes=cell.changes[:self.seeds],
                             steps=cell.steps[:self.seeds])


def _write_whole(path, arrays):
    """Write arrays to an .npz file; an error names it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as part, part.open('wb') as file:
            np.savez_compressed(file, **arrays)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
