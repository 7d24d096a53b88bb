# SPDX-License-Identifier: Apache-2.0
"""Results on disk: a cell is one run repeated with many seeds, computed once."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
import hashlib
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile
import zlib

import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.training_runs import (
    config_of,
    reference_returns_of,
    Run,
    RunResult,
)
from comply_ros.storage.file_system import atomic_write
from comply_ros.storage.map_name import file_stem
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.storage.versions import ALGORITHM_VERSION, FORMAT_VERSION, LATER_FIELDS


class CellData(NamedTuple):
    """
    Results of one run with the seeds 0, 1, ..., as in `RunResult`.

    returns, changes: `returns[seed, iteration]`. steps: `steps[seed]`. confidence, visited, q: of
    the learner with seed 0.
    """

    returns: NDArray[np.float64]
    changes: NDArray[np.float64]
    steps: NDArray[np.int64]
    confidence: NDArray[np.float64]
    visited: NDArray[np.bool_]
    q: NDArray[np.float64]


class ResultCache:
    """
    A folder of cells, each a file named by what was run and by the versions of what is stored.

    seeds: how many seeds a cell must have.
    """

    def __init__(self, folder: str | Path, seeds: int) -> None:
        self.folder, self.seeds = Path(folder), seeds
        self._loaded: dict[Path, CellData] = {}

    def has(self, run: Run, watched: bool = False) -> bool:
        """Tell whether a whole cell is there, with enough seeds; watched: and with changes."""
        cell = self._read(run)
        return cell is not None and (cell.changes.size > 0 or not watched)

    def load(self, run: Run) -> CellData:
        """Return the cell of a run; raise KeyError if it is not there."""
        cell = self._read(run)
        if cell is None:
            raise KeyError(run)
        return cell

    def save(self, run: Run, results: Sequence[RunResult]) -> None:
        """Write the cell of the results of the seeds 0, 1, ...; an OSError names the file."""
        first = results[0]
        cell = CellData(
            np.array([each.returns for each in results]),
            np.array([each.changes for each in results]),
            np.array([each.steps for each in results]),
            np.array(first.confidence), first.visited, first.q)
        path = self._path(run)
        _write_whole(path, cell._asdict())
        self._loaded[path] = cell

    def has_extra(self, kind: str, run: Run) -> bool:
        """Tell whether the curves that a kind of figure needs of a run are there."""
        return self._extra_path(kind, run).exists()

    def save_extra(self, kind: str, run: Run, curves: NamedTuple) -> None:
        """Write the curves that a kind of figure needs of a run; an OSError names the file."""
        _write_whole(self._extra_path(kind, run), curves._asdict())

    def load_extra(self, kind: str, run: Run) -> dict[str, NDArray[Any]]:
        """Return the arrays that `save_extra` has written; raise OSError if there are none."""
        with np.load(self._extra_path(kind, run)) as file:
            return {name: file[name] for name in file}

    def _extra_path(self, kind: str, run: Run) -> Path:
        path = self._path(run)
        return path.with_name(f'{kind}-{self.seeds}-{path.name}')

    def _path(self, run: Run) -> Path:
        spec = read_mentor_spec(run.mentor)  # files count by what is in them, not by their names
        grid = reference_returns_of(run).world.sha256
        config = config_of(run)
        # A later field that is changed has its name beside its value: others may be left out.
        settings = tuple(value if name not in LATER_FIELDS else (name, value)
                         for name, value in asdict(config).items()
                         if name not in LATER_FIELDS or value != LATER_FIELDS[name])
        policy = hashlib.sha256(spec.value.policy.tobytes()).hexdigest() \
            if spec.kind == 'learned' else None
        spec = spec._replace(value=policy) if policy else spec
        key = (grid, run.profile, run.method, settings, tuple(spec),
               run.mentor_seed, run.budget, run.advising, FORMAT_VERSION, ALGORITHM_VERSION)
        name = hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        return self.folder / f'{file_stem(run.map)}-{run.method}-{name}.npz'

    def _read(self, run: Run) -> CellData | None:
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


def _write_whole(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays to an .npz file, whole or not at all; an OSError names it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as part, part.open('wb') as file:
            np.savez_compressed(file, **arrays)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
