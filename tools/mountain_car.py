# SPDX-License-Identifier: Apache-2.0
"""What compliance makes of three mentors in MountainCar, as a figure and a table of numbers."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.stepped_training import SteppedTraining
from comply_ros.learner.presets import find_method
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.plots.grid_plot import write_picture
from comply_ros.storage.gymnasium_world import EnvironmentName, EnvironmentWorld
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from examples import mountain_car_mentor

ENVIRONMENT = 'MountainCar-v0'
MENTORS = {'none': None, 'swing': mountain_car_mentor.swing, 'look': mountain_car_mentor.look,
           'right': mountain_car_mentor.right}
METHODS = ('vanishing', 'jump_start', 'beta_implicit')
ALONE = 'q_learning_epsilon'
ITERATIONS, EPISODES = 200, 5
WORST = -200.0  # of all returns: an action that was never tried looks no better than the advice
COLORS = {'none': '#8a8f98', 'swing': '#0072b2', 'look': '#009e73', 'right': '#cc3311'}


def episode_returns(method: str, mentor: Callable[[float, float], int] | None,
                    seed: int) -> NDArray[np.float64]:
    """
    Return the mean return of each iteration of a learner in MountainCar: the bits of the nodes.

    mentor: its action at a position and velocity; None for no mentor.
    """
    made = EnvironmentWorld(EnvironmentName(ENVIRONMENT, bins=(mountain_car_mentor.BINS,)))
    world = World(made.source)
    advice = [mountain_car_mentor.advice(mentor, s) if mentor else NO_ACTION
              for s in range(world.n_states)]
    config = find_method(method, 'published')
    training = SteppedTraining(
        world, made.moves(seed), AdviceBudget(world, advice),
        replace(config, iterations=ITERATIONS, episodes=EPISODES, measuring_iterations=0,
                initial_value=WORST if mentor else config.initial_value), seed)
    return np.array([training.iterate().mean_return for _ in range(ITERATIONS)])


def figure_of(curves: dict[tuple[str, str], NDArray[np.float64]]) -> Figure:
    """Return a figure with a picture for each method and a line for each mentor."""
    figure = Figure(figsize=(11.0, 3.6), layout='constrained')
    episodes = EPISODES * np.arange(1, ITERATIONS + 1)
    all_axes: Any = figure.subplots(1, len(METHODS), sharey=True)
    for axes, method in zip(all_axes, METHODS, strict=True):
        for mentor in MENTORS:
            values = curves[ALONE if mentor == 'none' else method, mentor]
            smooth = np.array([np.convolve(each, np.ones(20) / 20, 'valid') for each in values])
            axes.plot(episodes[19:], smooth.mean(axis=0), color=COLORS[mentor], linewidth=1.8,
                      label=f'no mentor ({ALONE})' if mentor == 'none' else f'mentor {mentor}')
            axes.fill_between(episodes[19:], smooth.min(axis=0), smooth.max(axis=0), linewidth=0,
                              color=COLORS[mentor], alpha=0.15)
        axes.set_title(method, fontsize=11)
        axes.set_xlabel('episode')
        axes.spines[['top', 'right']].set_visible(False)
        axes.grid(axis='y', color='#e4e6ea')
    all_axes[0].set_ylabel('return')
    all_axes[-1].legend(loc='center right', fontsize=8, frameon=False)
    return figure


def main(argv: Sequence[str]) -> int:
    """Write the figure, and print a line for each method and mentor; return the exit code."""
    parser: argparse.ArgumentParser = CommandParser('mountain_car', description=__doc__)
    parser.add_argument('--seeds', type=whole_number, default=5, metavar='N')
    parser.add_argument('--out', type=Path, default=Path('docs/results/mountain_car.png'))
    options = parser.parse_args(argv[1:])
    curves = {}
    for method, mentor in ((ALONE, 'none'), *(
            (method, mentor) for method in METHODS for mentor in MENTORS if mentor != 'none')):
        values = np.array([episode_returns(method, MENTORS[mentor], seed)
                           for seed in range(options.seeds)])
        curves[method, mentor] = values
        first, last = values[:, :20].mean(), values[:, -20:].mean(axis=1)  # of 100 episodes
        print(f'| `{method}` | {mentor} | {first:.0f} | {last.mean():.0f} | {last.min():.0f} to '
              f'{last.max():.0f} |', flush=True)
    write_picture(figure_of(curves), options.out, compression=9)
    return 0
