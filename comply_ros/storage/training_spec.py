# SPDX-License-Identifier: Apache-2.0
"""What a training is of: map, method, mentor and seeds, read from their files and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import os
from typing import Any, TypeVar

from comply_ros.learner.learner_config import ConfigError, LearnerConfig, with_text
from comply_ros.learner.learning_result import begin_from, Learned
from comply_ros.learner.mentor_factory import validate_mentor
from comply_ros.learner.presets import find_method
from comply_ros.mentor.advice_budget import (
    UNLIMITED,
    validate_advice_budget,
    validate_advising,
)
from comply_ros.mentor.mentor_spec import MentorSpec
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.learning_file import read_learning
from comply_ros.storage.map_files import read_world
from comply_ros.storage.mentor_cache import read_mentor_spec, validate_files
from comply_ros.world.grid import Grid
from comply_ros.world.mdp import Source, World
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table


@dataclass(frozen=True)
class TrainingSpec:
    """
    A training that can be run.

    Attributes
    ----------
    map_name, profile, method, mentor, mentor_seed, seed, budget, advising: as in `spec_training`.
    settings: the fields of the method that were changed.
    initial_learning: path of the file, or what it is from; None without one.
    source, config, spec, initial: what map, method, mentor and initial learning stand for.

    """

    map_name: str
    profile: str
    method: str
    mentor: str
    mentor_seed: int
    seed: int
    settings: dict[str, Any]
    budget: int
    advising: str
    initial_learning: str | None
    source: Source
    config: LearnerConfig
    spec: MentorSpec
    initial: Learned | None


UNKNOWN_WORLD = Spaces(1, ('unknown',), 1)  # of a training whose world is not known yet
Spec = TypeVar('Spec', bound=TrainingSpec)


def spec_training(map_name: str | os.PathLike[str] | Source | None = 'maze',
                  method: str = 'beta_implicit', mentor: str = 'snapshot:0.75', *,
                  profile: str = 'published', seed: int = 0, mentor_seed: int = 0,
                  budget: int = UNLIMITED, advising: str = 'early',
                  initial_learning: str | os.PathLike[str] | Learned | None = None,
                  settings: Mapping[str, Any] | None = None) -> TrainingSpec:
    """
    Return a training, with its files read and everything checked that can be wrong.

    Parameters
    ----------
    map_name: of a map of the package, or path of a map file; or the map itself. None if it is not
        known yet: `in_world` checks what depends on it.
    method: name of a preset.
    mentor: as in `parse_mentor_spec`.
    profile: settings of the text of the report, or of the runs behind its figures.
    seed, mentor_seed: of world and learner, and of the mentor.
    budget, advising: as in `AdviceBudget`.
    initial_learning: what to begin with, or the path of its file.
    settings: values by name of the fields of the method to change.

    Raises
    ------
    MapError, ConfigError, MentorError, PolicyError, LearningError: for the first that is wrong.

    """
    config, changed = _config(method, profile, settings or {})
    for name, number in (('seed', seed), ('mentor_seed', mentor_seed)):
        if not 0 <= number <= SEED_LIMIT:
            raise ConfigError(f'{name} must lie in [0, {SEED_LIMIT}], got {number}')
    validate_advice_budget(budget, advising)
    initial, start = _initial(initial_learning)
    training = TrainingSpec(
        'unknown', profile, method, mentor, mentor_seed, seed, changed, budget, advising, start,
        UNKNOWN_WORLD, config, read_mentor_spec(mentor), initial)
    return training if map_name is None else in_world(training, *_source(map_name, profile))


def in_world(training: Spec, name: str, source: Source) -> Spec:
    """
    Return a training in another world, in which its mentor and initial learning can be.

    Raises
    ------
    MentorError, PolicyError, LearningError: otherwise.

    """
    spec, initial = training.spec, training.initial
    if isinstance(source, Spaces):
        validate_mentor(spec, World(source))
        validate_advising(training.budget, training.advising, World(source))
    validate_files(spec, World(source))
    if initial:
        begin_from(initial, World(source), training.config, tuple(spec.by_name()))
    return replace(training, map_name=name, source=source)


def _config(method: str, profile: str,
            settings: Mapping[str, Any]) -> tuple[LearnerConfig, dict[str, Any]]:
    """Return a method with the settings, and these in the types of its fields."""
    config, changed = find_method(method, profile), {}
    for name, value in settings.items():
        config = with_text(config, name, str(value))
        changed[name] = getattr(config, name)
    if config.iterations == 0:
        raise ConfigError('a training needs an end: iterations must be at least 1, got 0')
    return config, changed


def _source(given: str | os.PathLike[str] | Source, profile: str) -> tuple[str, Source]:
    """Return the name of a map, and the map itself."""
    if isinstance(given, Grid | Table | Spaces):
        return f'{type(given).__name__.lower()} {given.sha256[:8]}', given
    return os.fspath(given), read_world(os.fspath(given), profile)


def _initial(given: str | os.PathLike[str] | Learned | None,
             ) -> tuple[Learned | None, str | None]:
    """Return an initial learning and where it is from; None for none."""
    if given is None or given == '':
        return None, None
    if isinstance(given, Learned):
        return given, given.source
    return read_learning(given), os.fspath(given)
