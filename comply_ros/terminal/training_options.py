# SPDX-License-Identifier: Apache-2.0
"""The options that `train` and `lesson` share, checked before anything starts."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
import sys

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.learning_result import LearningError
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.advice_budget import UNLIMITED
from comply_ros.mentor.mentor_spec import FROM_FILES, MentorError
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.mentor.several_mentors import joined, split_mentors
from comply_ros.storage.gymnasium_moves import EnvironmentFault
from comply_ros.storage.map_name import file_stem, map_names, OTHER_MAPS
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.storage.training_spec import spec_training, TrainingSpec
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.terminal.standard_output import is_closed
from comply_ros.world.grid import MapError
from comply_ros.world.planning import PlanningError

# Their messages are for the user.
MISTAKES = (MapError, MentorError, ConfigError, LearningError, OutputError, PlanningError,
            PolicyError, EnvironmentFault)


@dataclass(frozen=True)
class TrainingOptions(TrainingSpec):
    """
    The options of a training, checked.

    Attributes
    ----------
    out: folder for the results.
    args: the parsed command line, for options that only one command has.

    """

    out: Path
    args: argparse.Namespace


def training_parser(program: str, description: str, **own: str) -> argparse.ArgumentParser:
    """
    Return a parser of the options that `train` and `lesson` share.

    own: defaults of `iterations` and `out`, where the program has its own ones.
    """
    parser = CommandParser(program, description=description)
    add = parser.add_argument
    add('--map', default='maze', metavar='NAME|FILE',
        help=f'{", ".join(map_names())}, {OTHER_MAPS} (default: %(default)s)')
    add('--method', default='beta_implicit', metavar='NAME',
        help=f'{", ".join(METHODS["published"])} (default: %(default)s)')
    add('--mentor', default='snapshot:0.75', metavar='SPEC',
        help='optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, learned:FILE.npz '
        '(what another training learned) or none; with @C behind it, in a share C of the states '
        'only (default: %(default)s)')
    add('--mentors', nargs='+', metavar='SPEC',
        help='several mentors instead of one, such as optimal noisy:0.6 anna=file:me.txt; the '
        'last one has the name anna, the others have names by what they are')
    add('--mentor-seed', type=whole_number, default=0, metavar='K',
        help='which one of the mentors of this kind; each of several has the next number '
        '(default: %(default)s)')
    add('--budget', type=whole_number, default=UNLIMITED, metavar='N',
        help='recommendations that each mentor may give; 0: no limit (default)')
    add('--advising', default='early', metavar='WHEN',
        help='when a mentor with a budget gives advice: early (in the first states), important '
        '(where much depends on the action) or mistakes (where the learner last chose another '
        'action) (default: %(default)s)')
    add('--profile', default='published', metavar='NAME',
        help='settings of the report: published (the runs behind its figures) or report (its '
        'text) (default: %(default)s)')
    add('--iterations', metavar='N', default=own.get('iterations'),
        help=f'(default: {own.get("iterations", "that of the method, mostly 400")})')
    add('--episodes', metavar='N', help='per iteration (default: that of the method, mostly 15)')
    add('--seed', type=whole_number, default=0, metavar='K', help='(default: %(default)s)')
    add('--from', metavar='FILE.npz', dest='initial_learning',
        help='begin with the values and beliefs of a learning.npz of the same world; schedules, '
        'counts and random numbers begin anew: it does not continue that training')
    add('--set', action='append', default=[], metavar='FIELD=VALUE', dest='changes',
        help='change one field of the method; may be repeated')
    add('--out', metavar='DIR', default=own.get('out'),
        help=f'(default: {own.get("out", "runs/MAP-METHOD-MENTOR-SEED")})')
    parser.set_defaults(external='')  # the part that runs already, where a command has that
    return parser


def check_options(args: argparse.Namespace) -> TrainingOptions:
    """Return the checked options, with the folder made; raises one of MISTAKES."""
    is_external = args.external == 'world'
    text = joined(args.mentors or args.mentor)
    training = spec_training(
        None if is_external else args.map, args.method, text, profile=args.profile,
        seed=args.seed, mentor_seed=args.mentor_seed, budget=args.budget, advising=args.advising,
        initial_learning=args.initial_learning, settings=dict(_changes(args)))
    kind, _, value = text.partition(':')
    mentor = '-'.join(split_mentors(text)) or (
        Path(value).stem if kind in FROM_FILES else text.replace(':', '_'))
    name = 'external' if is_external else file_stem(args.map)
    folder = f'{name}-{args.method}-{mentor}-{args.seed}'
    return TrainingOptions(
        **vars(training), out=prepare_folder(args.out or Path('runs') / folder), args=args)


def _changes(args: argparse.Namespace) -> Iterator[tuple[str, str]]:
    for change in args.changes:
        name, equals, text = change.partition('=')
        if not equals:
            raise ConfigError(f'--set takes FIELD=VALUE, got {change!r}')
        yield name, text
    for name in ('iterations', 'episodes'):
        if getattr(args, name) is not None:
            yield name, getattr(args, name)


def main_with(parser: argparse.ArgumentParser, run: Callable[[TrainingOptions], int],
              argv: Sequence[str]) -> int:
    """Return the exit code of `run(options)` for the options of a command line, as `guarded`."""
    args = parser.parse_args(argv[1:])
    return guarded(parser.prog, MISTAKES, lambda: run(check_options(args)))


def guarded(program: str, mistakes: tuple[type[Exception], ...], run: Callable[[], int]) -> int:
    """
    Return the exit code of `run()`; print what went wrong in one line.

    mistakes: exceptions whose message is for the user (exit code 2, or that of its attribute
        `exit_code`).
    """
    try:
        return run()
    except mistakes as mistake:
        print(f'{program}: {mistake}', file=sys.stderr)
        return getattr(mistake, 'exit_code', 2)
    except OSError as error:
        if isinstance(error, BrokenPipeError) and is_closed():
            raise
        reason = (error.strerror or str(error)).lower()
        print(f'{program}: {error.filename or "output"}: {reason}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f'{program}: interrupted', file=sys.stderr)
        return 130
