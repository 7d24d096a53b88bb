# SPDX-License-Identifier: Apache-2.0
"""`plot BAG`: draws learning curve, confidence, trust map and episode lengths of a training."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.message_decoder import DecodedMessages, world_from_description
from comply_ros.bags.replay import bag_parser, with_progress
from comply_ros.plots import training_plots
from comply_ros.protocol.run_reports import RunReports
from comply_ros.protocol.world_description import is_same_world
from comply_ros.storage.file_system import printable
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.terminal.training_options import guarded
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import PlanningError
from comply_ros.world.reference_returns import reference_returns


def add_message(reports: RunReports, topic: str, msg: Any) -> RunReports:
    """Add the next message of a bag; return new reports where another training starts."""
    description = reports.description
    if topic == 'world' and description and not is_same_world(msg, description):
        reports = RunReports(history=True)
    elif topic == 'method' and msg.observation_count == 0 and reports.progress:  # it was reset
        reports = RunReports(history=True)
        reports.description = description
    reports.add(topic, msg)
    return reports


def main(argv: list[str]) -> int:
    """Run the command; return the exit code."""
    parser = bag_parser(
        'plot', 'Draw learning curve, confidence, trust map and episode lengths of a bag.')
    parser.add_argument('--out', metavar='DIR', help='(default: BAG-pictures, beside the bag)')
    options = parser.parse_args(argv[1:])
    return guarded('plot', (BagError, OutputError, PlanningError), lambda: run(options))


def run(options: argparse.Namespace) -> int:
    """Read a bag, write the pictures and print their paths; return the exit code."""
    messages = DecodedMessages(Bag(options.bag), options.namespace)
    reports = RunReports(history=True)
    for topic, msg in with_progress(messages, 'plot'):
        reports = add_message(reports, topic, msg)
    path = messages.bag.path.resolve()
    folder = prepare_folder(options.out or path.with_name(f'{path.stem}-pictures'))
    pictures = draw(reports, folder)
    if not pictures:
        raise BagError(f'bag {options.bag!r} has no episode, progress or trust to draw')
    for picture in pictures:
        print(printable(picture))
    return 0


def draw(reports: RunReports, folder: Path) -> list[Path]:
    """Draw what was recorded; return the paths of the pictures."""
    if reports.description is None:
        return []
    world = world_from_description(reports.description)
    reports.validate_maps(world)
    mentors, pictures = reports.mentor_names(), []
    advices = [_advice(reports, name, world) for name in mentors]
    trusts = [reports.of_mentor(name).trust for name in mentors]
    progress, episodes = reports.progress_by_iteration, list(reports.episodes.values())
    summary = {'method': reports.learner.method if reports.learner else 'learner',
               'map': reports.description.name, 'mentor': 'as recorded',
               'episodes': max((each.episodes for each in progress.values()), default=0)}
    if progress:
        reference = reference_returns(world)
        summary['optimal_return'] = reference.optimal_return
        summary['mentor_return'] = None if len(mentors) > 1 or advices[0] is None else \
            reference.return_of(advices[0])
        curve = [progress[number].mean_return if number in progress else np.nan
                 for number in range(1, max(progress) + 1)]  # nan: not in the bag
        pictures.append(folder / 'learning_curve.png')
        training_plots.draw_learning_curve(pictures[-1], np.array([curve]), summary)
    confidences = {name: reports.confidence_curve(name) for name in mentors}
    if any(each.is_known for each in confidences.values()):
        pictures.append(folder / 'confidence.png')
        training_plots.draw_confidence_curves(pictures[-1], confidences, summary)
    shown = [m for m in range(len(mentors)) if trusts[m] is not None and advices[m] is not None]
    if shown:
        pictures.append(folder / 'trust_map.png')
        visited = np.isin(np.arange(len(world.terminal)), list(reports.visited))
        training_plots.draw_trust_map(
            pictures[-1], world, np.concatenate([advices[m] for m in shown]),
            np.concatenate([trusts[m] for m in shown]), visited, summary,
            [mentors[m] for m in shown])
    if episodes:
        pictures.append(folder / 'episode_lengths.png')
        training_plots.draw_episode_lengths(pictures[-1], episodes, world.step_limit,
                                            summary)
    return pictures


def _advice(reports: RunReports, name: str, world: World) -> NDArray[Any] | None:
    """`advice[s]` by a mentor's policy, else by its recommendations; None without any."""
    advice = reports.of_mentor(name).policy
    if advice is None:
        advice = np.full(world.n_states, NO_ACTION, dtype=world.action_type)
        for state, action in reports.advice.get(name, {}).items():
            if state < len(advice) and world.free[state] and 0 <= action < world.n_actions \
                    and world.available[state, action]:
                advice[state] = action
    return advice if (advice != NO_ACTION).any() else None
