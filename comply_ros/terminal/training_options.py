# SPDX-License-Identifier: Apache-2.0
"""What a session is asked to do: the options that `train` and `lesson` share, checked at once."""

import argparse
from dataclasses import dataclass
from pathlib import Path
import sys

from comply_ros.learner.learner_config import ConfigError, LearnerConfig, with_text
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.mentor.advice_budget import UNLIMITED, validate_advice_budget
from comply_ros.mentor.mentor_policies import MentorError, MentorSpec
from comply_ros.mentor.policy_text import parse_policy, PolicyError
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.map_files import map_names, read_map
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.world.grid import Grid, MapError
from comply_ros.world.mdp import World
from comply_ros.world.planning import PlanningError

MISTAKES = (MapError, MentorError, ConfigError, OutputError, PlanningError, PolicyError)


@dataclass(frozen=True)
class TrainingOptions:
    """
    A checked session: what was asked for, and what it means.

    Attributes
    ----------
    map_name, profile, method, mentor, mentor_seed, seed: as given.
    settings: table of what `--set`, `--iterations` and `--episodes` changed.
    budget, advising: how many recommendations the mentor has, and when it gives one.
    grid, row, spec: the `Grid`, `LearnerConfig` and mentor `MentorSpec` that these stand for.
    out: `Path` of the folder for the results.
    rest: the parsed command line, for options that only one command has.

    """

    map_name: str
    profile: str
    method: str
    mentor: str
    mentor_seed: int
    seed: int
    settings: dict
    budget: int
    advising: str
    grid: Grid
    row: LearnerConfig
    spec: MentorSpec
    out: Path
    rest: argparse.Namespace


def training_parser(program, description):
    """`ArgumentParser` with the options that `train` and `lesson` share."""
    parser = argparse.ArgumentParser(program, description=description)
    add = parser.add_argument
    add('--map', default='maze', metavar='NAME|FILE',
        help=f'{", ".join(map_names())}, or a map file (default: %(default)s)')
    add('--method', default='beta_implicit', metavar='NAME',
        help=f'{", ".join(METHODS["published"])} (default: %(default)s)')
    add('--mentor', default='snapshot:0.75', metavar='SPEC',
        help='optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, none; with @C behind '
        'it, in a share C of the states only (default: %(default)s)')
    add('--mentor-seed', type=int, default=0, metavar='K',
        help='which one of the mentors of this kind (default: %(default)s)')
    add('--budget', type=int, default=UNLIMITED, metavar='N',
        help='recommendations that the mentor has to give; 0: no limit (default)')
    add('--advising', default='early', metavar='WHEN',
        help='with a budget: early, important (where much depends on it) or mistakes (where the '
        'learner did something else the last time) (default: %(default)s)')
    add('--profile', default='published', metavar='NAME',
        help='report: as its text says; published: as the runs behind its figures '
        '(default: %(default)s)')
    add('--iterations', metavar='N', help="(default: the method's own, mostly 400)")
    add('--episodes', metavar='N', help="per iteration (default: the method's own, mostly 15)")
    add('--seed', type=int, default=0, metavar='K', help='(default: %(default)s)')
    add('--set', action='append', default=[], metavar='FIELD=VALUE', dest='changes',
        help='change one field of the method; may be repeated')
    add('--out', metavar='DIR', help='(default: runs/MAP-METHOD-MENTOR-SEED)')
    return parser


def check_options(given):
    """
    `TrainingOptions` of a parsed command line. Everything that can be wrong is said now.

    Raises
    ------
    one of MISTAKES: naming the thing, the rule and the value.

    """
    row = find_method(given.method, given.profile)
    settings = {}
    for name, text in _changes(given):
        row = with_text(row, name, text)
        settings[name] = getattr(row, name)
    if row.iterations == 0:
        raise ConfigError('a session needs an end: iterations must be at least 1, got 0')
    for name in ('seed', 'mentor_seed'):
        if not 0 <= getattr(given, name) <= SEED_LIMIT:
            raise ConfigError(f'{name} must lie in [0, {SEED_LIMIT}], got {getattr(given, name)}')
    validate_advice_budget(given.budget, given.advising)
    grid, spec = read_map(given.map, given.profile), read_mentor_spec(given.mentor)
    if spec.kind == 'file':
        parse_policy(spec.value, World(grid))
    mentor = Path(given.mentor).stem if spec.kind == 'file' else given.mentor.replace(':', '_')
    name = f'{Path(given.map).stem}-{given.method}-{mentor}-{given.seed}'
    return TrainingOptions(given.map, given.profile, given.method, given.mentor, given.mentor_seed,
                   given.seed, settings, given.budget, given.advising, grid, row, spec,
                   prepare_folder(given.out or Path('runs') / name), given)


def _changes(given):
    for change in given.changes:
        name, equals, text = change.partition('=')
        if not equals:
            raise ConfigError(f'--set takes FIELD=VALUE, got {change!r}')
        yield name, text
    for name in ('iterations', 'episodes'):
        if getattr(given, name) is not None:
            yield name, getattr(given, name)


def main_with(parser, run, argv):
    """Parse a command line, run it, and return the exit code; a mistake is one line and 2."""
    given = parser.parse_args(argv[1:])
    return guarded(parser.prog, MISTAKES, lambda: run(check_options(given)))


def guarded(program, mistakes, run):
    """
    Return the exit code of run(); what goes wrong is told in one line.

    mistakes: exception types whose message is for the user (exit code 2).
    """
    try:
        return run()
    except mistakes as mistake:
        print(f'{program}: {mistake}', file=sys.stderr)
        return 2
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        print(f'{program}: {error.filename or "output"}: {reason}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f'{program}: interrupted', file=sys.stderr)
        return 130
