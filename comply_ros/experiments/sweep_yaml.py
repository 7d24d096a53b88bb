# SPDX-License-Identifier: Apache-2.0
"""The file of a sweep: methods x mentors x settings x seeds, and every way it can be wrong."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import product
from math import prod
from pathlib import Path
from typing import Annotated, Any, NoReturn

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    create_model,
    Field,
    ValidationError,
    ValidationInfo,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from comply_ros.experiments.sweep_grid import Sweep
from comply_ros.experiments.training_runs import (
    config_of,
    reference_returns_of,
    Run,
    setting_value,
)
from comply_ros.learner.learner_config import CONFIG_FIELDS, ConfigError
from comply_ros.learner.mentor_factory import validate_mentor
from comply_ros.mentor.advice_budget import validate_advice_budget, validate_advising
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.file_system import PathError
from comply_ros.storage.mentor_cache import read_mentor_spec, validate_files
from comply_ros.storage.text_and_yaml_files import (
    LinedYaml,
    load_yaml,
    read_text,
    shown,
    YamlError,
)
from comply_ros.terminal.training_options import MISTAKES

FIELDS = {  # key of the file: field of `Run`; the last one varies fastest
    'map': 'map', 'profile': 'profile', 'mentors': 'mentor', 'mentor_seeds': 'mentor_seed',
    'budgets': 'budget', 'advising': 'advising', 'methods': 'method', 'settings': None,
    'seeds': 'seed'}
MAX_RUNS = 1_000_000
MAX_VALUE_LENGTH = 1000  # characters
KEY_ERRORS = ('extra_forbidden', 'invalid_key', 'missing')  # of pydantic, first to last


class SweepFileError(ValueError):
    """An invalid sweep file; the message names the file, the line, the rule and the value."""


def _as_list(value: Any) -> Any:
    """Return a single value as a list of it."""
    return value if isinstance(value, list) else [value]


def _as_seeds(value: Any, info: ValidationInfo) -> Any:
    """Return 0 to n - 1 for a single number n."""
    if type(value) is not int:
        return _as_list(value)
    if not 1 <= value <= MAX_RUNS:
        raise ValueError(f'the number of {info.field_name} must lie in [1, {MAX_RUNS}], '
                         f'got {value}')
    return list(range(value))


def _without_repeats(values: list[Any], info: ValidationInfo) -> list[Any]:
    """Return the values; fail at the first one that is there for the second time."""
    seen = set()
    for place, value in enumerate(values):
        if value in seen:
            raise PydanticCustomError('repeated', '{text}', {
                'place': place, 'text': f'{info.field_name} must differ from each other, '
                f'got {shown(value)} twice'})
        seen.add(value)
    return values


def _setting(name: str, value: Any) -> Any:
    """Return the value of a field of the methods, in its type."""
    if isinstance(value, list | dict):
        raise ValueError(f'each of {name} must be a single value, got {_kind(value)}')
    return setting_value(name, value)


def _values(item: Any, as_list: Any = _as_list) -> Any:
    """Type of a key of the file: different values of a type, at least one."""
    return Annotated[list[item], Field(min_length=1), BeforeValidator(as_list),
                     AfterValidator(_without_repeats)]


Word = Annotated[str, Field(max_length=MAX_VALUE_LENGTH)]
Words = _values(Word)
Seeds = _values(Annotated[int, Field(ge=0, le=SEED_LIMIT)], _as_seeds)
Budgets = _values(Annotated[int, AfterValidator(
    lambda budget: validate_advice_budget(budget, 'early') or budget)])
Advising = _values(Annotated[Word, AfterValidator(
    lambda advising: validate_advice_budget(0, advising) or advising)])
RULES = ConfigDict(extra='forbid', strict=True)
Settings = create_model('Settings', __config__=RULES, **{
    name: (_values(Annotated[Any, AfterValidator(partial(_setting, name))]), None)
    for name in CONFIG_FIELDS})


class SweepFile(BaseModel):
    """The keys of a sweep file, and the types of their values."""

    model_config = RULES
    map: Words = [Run().map]
    profile: Words = [Run().profile]
    mentors: Words
    mentor_seeds: Seeds = [Run().mentor_seed]
    budgets: Budgets = [Run().budget]
    advising: Advising = [Run().advising]
    methods: Words
    settings: Settings = Settings()
    seeds: Seeds


def read_sweep(path: str | Path) -> Sweep:
    """Return the sweep of a file; a SweepFileError names file, line, rule and value."""
    try:
        return parse_sweep(read_text(path))
    except PathError as error:
        raise SweepFileError(
            f'a sweep file must be readable, got {str(path)!r} ({error})') from None
    except SweepFileError as error:
        raise SweepFileError(f'{path}, {error}') from None


def parse_sweep(text: str) -> Sweep:
    """
    Return the sweep of a file's YAML text; a SweepFileError names line, rule and value.

    Every value is checked, but mentors are not generated.
    """
    try:
        content = load_yaml(text)
    except YamlError as error:
        raise SweepFileError(f'line {error.line}: {error.about("a sweep")}') from None
    if not isinstance(content.value, dict):
        raise SweepFileError(f'line {content.line_of(())}: a sweep must be a table of '
                             f'{", ".join(FIELDS)}, got {_kind(content.value)}')
    try:
        file = SweepFile.model_validate(content.value)
    except ValidationError as error:
        raise SweepFileError(_first_sentence(error.errors(), content)) from None
    axes: dict[str, tuple] = {}
    for key, field in FIELDS.items():
        if field is not None:
            axes[field] = tuple(getattr(file, key))
        else:  # in the order of the file
            axes |= {name: tuple(getattr(file.settings, name))
                     for name in content.value.get(key) or ()}
    count = prod(map(len, axes.values()))
    if count > MAX_RUNS:
        raise SweepFileError(f'line {content.line_of(("seeds",))}: a sweep may have at most '
                             f'{MAX_RUNS} runs, got {count}')
    _check_together(axes, content)
    _check_methods(axes, content)
    return Sweep(axes)


def _first_sentence(errors: list[ErrorDetails], content: LinedYaml) -> str:
    """Return the sentence about the first error of a file: wrong and missing keys come first."""
    ranked = []
    for error in errors:
        loc, kind = error['loc'], error['type']
        place = (*loc, error['ctx']['place']) if kind == 'repeated' else loc
        rank = KEY_ERRORS.index(kind) if kind in KEY_ERRORS and len(loc) == 1 else len(KEY_ERRORS)
        ranked.append((rank, content.line_of(place), _sentence(error)))
    _, line, sentence = min(ranked)
    return f'line {line}: {sentence}'


def _sentence(error: ErrorDetails) -> str:
    """Return the rule that an error of pydantic stands for, with the value."""
    value, loc = error['input'], error['loc']
    key = loc[0]
    match error['type']:
        case 'extra_forbidden' | 'invalid_key' if key == 'settings' and len(loc) > 1:
            return f'a method has no field {shown(loc[-1])}; it has {", ".join(CONFIG_FIELDS)}'
        case 'extra_forbidden' | 'invalid_key':
            return f'a sweep has the keys {", ".join(FIELDS)}, got {shown(key)}'
        case 'missing':
            return f'a sweep needs the key {key!r}'
        case 'model_type':
            return f'settings must be a table of fields of the methods, got {_kind(value)}'
        case 'too_short':
            return f'{loc[-1]} must have a value, got an empty list'
        case 'string_type' | 'int_type' if isinstance(value, list | dict):
            return f'each of {key} must be a single value, got {_kind(value)}'
        case 'string_type':
            return f'{key} must be words, got {shown(value)}'
        case 'int_type':
            return f'{key} must be whole numbers, got {shown(value)}'
        case 'string_too_long':
            return f'{key} may have at most {MAX_VALUE_LENGTH} characters, got {shown(value)}'
        case 'greater_than_equal' | 'less_than_equal':
            return f'each of {key} must lie in [0, {SEED_LIMIT}], got {value}'
        case 'value_error':
            return str(error['ctx']['error'])
    return error['msg']


def _kind(value: Any) -> str:
    """Return what a message calls a value."""
    if value is None:
        return 'nothing'
    return {list: 'a list', dict: 'a table'}.get(type(value)) or shown(value)


@contextmanager
def _at(content: LinedYaml, *place: Any) -> Iterator[None]:
    """Name the line of a value in the errors of a block."""
    try:
        yield
    except MISTAKES as error:
        raise SweepFileError(f'line {content.line_of(place)}: {error}') from None


def _check_together(axes: dict[str, tuple], content: LinedYaml) -> None:
    """Check values that need each other: maps and profiles, and policy files for the maps."""
    for k, profile in enumerate(axes['profile']):
        with _at(content, 'profile', k):
            config_of(Run(profile=profile))
    worlds = []
    for k, name in enumerate(axes['map']):
        with _at(content, 'map', k):
            worlds += [reference_returns_of(Run(map=name, profile=profile)).world
                       for profile in axes['profile']]
    for k, mentor in enumerate(axes['mentor']):
        with _at(content, 'mentors', k):
            spec = read_mentor_spec(mentor)
            for world in worlds:
                validate_mentor(spec, world)
                validate_files(spec, world)
    for k, when in enumerate(axes['advising']):
        with _at(content, 'advising', k):
            for world in worlds:
                validate_advising(max(axes['budget']), when, world)


def _check_methods(axes: dict[str, tuple], content: LinedYaml) -> None:
    """Check each method in each profile with each combination of the settings."""
    names = [name for name in axes if name not in Run._fields]
    for profile, (k, method) in product(axes['profile'], enumerate(axes['method'])):
        run = Run(profile=profile, method=method)
        with _at(content, 'methods', k):
            config_of(run)
        for items in product(*(enumerate(axes[name]) for name in names)):
            settings = tuple(zip(names, (value for _, value in items)))
            try:
                config_of(run._replace(settings=settings))
            except ConfigError:
                _fail_at_the_setting(run, settings, [place for place, _ in items], content)


def _fail_at_the_setting(run: Run, settings: tuple, places: list[int],
                         content: LinedYaml) -> NoReturn:
    """Raise the error of settings that do not fit each other, at the first one that is wrong."""
    for end, (name, _) in enumerate(settings, 1):
        with _at(content, 'settings', name, places[end - 1]):
            config_of(run._replace(settings=settings[:end]))
    raise AssertionError('settings that were wrong are not')
