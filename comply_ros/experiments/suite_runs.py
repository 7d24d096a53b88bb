# SPDX-License-Identifier: Apache-2.0
"""The runs of the suite: which worlds, mentors and methods, and which were looked at before."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from comply_ros.experiments.figures_beyond_report import WITH_MODEL
from comply_ros.experiments.training_runs import MENTOR_OF_SEED, Run
from comply_ros.storage.map_name import GARNET, map_names

ALONE = 'none'
MENTORS = ('optimal', 'noisy:0.3', 'snapshot:0.75', 'random', 'adversarial')
DRAWN = ('noisy:0.3', 'snapshot:0.75', 'random')  # of them, those that depend on a seed
BASELINES = ('q_learning', 'watkins', 'sarsa_lambda')  # without a mentor
GARNETS, FIRST_HELD_OUT_GARNET = 20, 10
# Held out at first; looked at later, while parts were chosen anew.
LOOKED_AT = ('cliff_walking', 'frozen_lake_8x8', 'stochastic_windy', 'windy', f'{GARNET}:15')

BINS = 20  # intervals of position and velocity of the car
MOUNTAIN_CAR = f'gym:MountainCar-v0?bins={BINS}'
MOUNTAIN_CAR_SETTINGS = (('iterations', 100), ('episodes', 3))  # its steps are not compiled
LEFT, RIGHT = 0, 2  # pushes of the car

ABLATION_INTENDED = (0.95, 0.7)  # probabilities that a move of the maze goes where it was meant to
ABLATIONS: Mapping[str, tuple[tuple[str, object], ...]] = {  # the settings that switch a part off
    WITH_MODEL: (),
    'no prior of slips': (('slip_prior', 1e-9),),
    'a prior that always counts as 8 samples': (('slip_prior', 8.0),),
    'few samples are not doubted': (('doubt_weight', 0.0),),
    'only the error of samples': (('advice_slack', 0.0),),
    'untried actions are worth 0': (('untried_value', 0.0),),
    'untried actions are not explored': (('exploration_probability', 0.0),),
    'both of these': (('untried_value', 0.0), ('exploration_probability', 0.0)),
    'the mentor is not heard': (('trust', 'none'),),
}


class SuiteWorld(NamedTuple):
    """
    A world of the suite.

    map: its name. held_out: whether it was not looked at while the method was made.
    settings: fields of every method that are changed in it.
    """

    map: str
    held_out: bool
    settings: tuple[tuple[str, object], ...] = ()

    def runs(self, profile: str) -> dict[str, Run]:
        """Return the runs of the method by mentor, and those of the others by their names."""
        with_mentors = {mentor: suite_run(self.map, profile, WITH_MODEL, mentor, self.settings)
                        for mentor in (ALONE, *MENTORS)}
        return with_mentors | {method: suite_run(self.map, profile, method, ALONE, self.settings)
                               for method in BASELINES}


def suite_run(map_name: str, profile: str, method: str, mentor: str,
              settings: tuple[tuple[str, object], ...] = ()) -> Run:
    """Return the run of a cell; a mentor that is drawn is another one for each seed."""
    return Run(map_name, profile, method, settings, mentor,
               MENTOR_OF_SEED if mentor in DRAWN else 0)


def suite_worlds() -> list[SuiteWorld]:
    """
    Return the worlds with a known optimum: the maps of the package, and twenty Garnets.

    Every second map in alphabetical order was held out, the second one first, but for `LOOKED_AT`,
    and of the Garnets those from the eleventh on.
    """
    return [*(SuiteWorld(name, number % 2 == 1 and name not in LOOKED_AT)
              for number, name in enumerate(map_names())),
            *(SuiteWorld(name, seed >= FIRST_HELD_OUT_GARNET and name not in LOOKED_AT)
              for seed, name in enumerate(f'{GARNET}:{seed}' for seed in range(GARNETS)))]


def ablation_runs(profile: str, folder: Path) -> dict[tuple[float, str, str], Run]:
    """
    Return the runs by intended probability, the part that is missing, and the mentor.

    folder: where a map file is written for each probability.

    Raises
    ------
    OSError: if it cannot be.

    """
    runs = {}
    for intended in ABLATION_INTENDED:
        path = folder / f'maze_{intended}.yaml'
        path.write_text(f'extends: maze\nintended: {intended}\n')
        for part, settings in ABLATIONS.items():
            for mentor in (ALONE, *MENTORS):
                if mentor == ALONE or ('trust', 'none') not in settings:
                    runs[intended, part, mentor] = suite_run(
                        str(path), profile, WITH_MODEL, mentor, settings)
    return runs


def mountain_car_runs(profile: str, folder: Path) -> dict[str, Run]:
    """
    Return the runs in MountainCar, as `SuiteWorld.runs`.

    folder: where the policy of a mentor is written that pushes the way that the car moves.

    Raises
    ------
    OSError: if it cannot be.

    """
    path = folder / 'mountain_car_swing.txt'
    path.write_text(''.join(f'{s} {RIGHT if s % BINS >= BINS // 2 else LEFT}\n'
                            for s in range(BINS * BINS)))
    return {
        **{name: suite_run(MOUNTAIN_CAR, profile, WITH_MODEL, spec, MOUNTAIN_CAR_SETTINGS)
           for name, spec in ((ALONE, ALONE), ('swing', f'file:{path}'))},
        **{method: suite_run(MOUNTAIN_CAR, profile, method, ALONE, MOUNTAIN_CAR_SETTINGS)
           for method in BASELINES}}
