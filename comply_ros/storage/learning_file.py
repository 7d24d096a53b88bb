# SPDX-License-Identifier: Apache-2.0
"""`learning.npz`: what a training has learned, to look at, to act by and to begin from."""

from dataclasses import asdict
import json
import os
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.learner_config import ConfigError, LearnerConfig
from comply_ros.learner.learner_state import LATER_ARRAYS, LearnerState, ONE_MENTOR
from comply_ros.learner.learning_result import Learned, LearningError
from comply_ros.mentor.several_mentors import MentorNameError, validate_mentor_names
from comply_ros.storage.file_system import atomic_write, path_errors, PathError
from comply_ros.storage.versions import FORMAT_VERSION

ARRAYS = ('advice', 'policy', 'confidence')  # beside those of the learner's state
FACTS = ('world', 'settings', 'format')
MENTORS = 'mentors'  # the names of several; a file with one mentor need not have it
MAX_TEXT = 200  # characters of what is wrong with the settings
MAX_BYTES = 6_000_000_000  # of all arrays: the largest grid has 4096 x 4096 states of 300 bytes


def save_learning(path: str | Path, learned: Learned) -> None:
    """
    Write what was learned to an .npz file, as a whole.

    Raises
    ------
    OSError: if it cannot be written; the file is as before.

    """
    arrays = {**learned.state._asdict(), **{name: getattr(learned, name) for name in ARRAYS}}
    with atomic_write(Path(path).expanduser()) as part, part.open('wb') as file:
        np.savez_compressed(
            file, **arrays, world=np.array(learned.world), format=np.array(FORMAT_VERSION),
            settings=np.array(json.dumps(asdict(learned.config))),
            **{MENTORS: np.array(learned.mentors)})


def read_learning(path: str | os.PathLike[str]) -> Learned:
    """
    Return what was learned from a file that `save_learning` wrote.

    `Learned.validate` tells whether the values in it can be, and are of a world.

    Raises
    ------
    LearningError: if it cannot be read, or holds something else.

    """
    try:
        with path_errors():
            file = Path(path).expanduser()
            is_other = file.exists() and not file.is_file()
            arrays = {} if is_other else _read_arrays(file)
    except PathError as error:
        raise LearningError(f'a learning file must be readable, got {str(path)!r} '
                            f'({error})') from None
    if is_other:
        raise LearningError(f'a learning must be read from a file, got {str(path)!r}')
    try:
        return _learned(arrays, f'the learning file {str(path)!r}')
    except LearningError as error:
        raise LearningError('a learning file must be as comply_ros writes it, got '
                            f'{str(path)!r} ({error})') from None


def _read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file that are known here, none where it is no .npz file."""
    with path.open('rb') as file:
        try:
            with ZipFile(file) as archive:
                if sum(each.file_size for each in archive.infolist()) > MAX_BYTES:
                    return {}
            with np.load(file, allow_pickle=False) as loaded:
                return {name: loaded[name] for name in _names() if name in loaded}
        except Exception:  # noqa: BLE001 - of other bytes, whatever zipfile, zlib and numpy raise
            return {}


def _names() -> tuple[str, ...]:
    return (*LearnerState._fields, *ARRAYS, *FACTS, MENTORS)


def _learned(arrays: dict[str, NDArray[Any]], source: str) -> Learned:
    arrays = {**LATER_ARRAYS, MENTORS: np.array(ONE_MENTOR), **arrays} if arrays else {}
    missing = [name for name in _names() if name not in arrays]
    if not arrays:
        raise LearningError('it is no .npz file, or it is damaged')
    if missing:
        raise LearningError(f'it has no array {missing[0]!r}: version 0.1.0 wrote none'
                            if missing[0] in ARRAYS else f'it has no array {missing[0]!r}')
    facts = {name: arrays[name] for name in FACTS}
    if any(each.shape for each in facts.values()) or facts['format'].dtype.kind not in 'iu' \
            or any(facts[name].dtype.kind != 'U' for name in ('world', 'settings')):
        raise LearningError('world and settings must be one text, and format one number')
    if facts['format'] != FORMAT_VERSION:
        raise LearningError(f'it has format {facts["format"]}, and this version of comply_ros '
                            f'reads format {FORMAT_VERSION}')
    try:
        config = LearnerConfig(**json.loads(str(facts['settings'])))
    except ConfigError as error:
        raise LearningError(f'of its settings, {str(error)[:MAX_TEXT]}') from None
    except (ValueError, TypeError, RecursionError):
        raise LearningError('its settings must be fields of a method') from None
    state = LearnerState(**{name: arrays[name] for name in LearnerState._fields})
    return Learned(str(facts['world']), config, state, *(arrays[name] for name in ARRAYS), source,
                   _mentors(arrays[MENTORS]))


def _mentors(names: NDArray[Any]) -> tuple[str, ...]:
    if names.dtype.kind != 'U' or names.ndim != 1:
        raise LearningError('mentors must be a list of names')
    mentors = tuple(names.tolist())
    try:
        validate_mentor_names(mentors)
    except MentorNameError as error:
        raise LearningError(str(error)[:MAX_TEXT]) from None
    return mentors
