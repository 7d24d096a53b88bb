# SPDX-License-Identifier: Apache-2.0
"""`plot BAG`: draws learning curve, trust map and episode lengths of a recorded training."""

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
from comply_ros.protocol.messages import Episode, Policy, Progress, Trust, WorldDescription
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.terminal.training_options import guarded
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import PlanningError, ReferenceReturns


class RecordedTraining:
    """
    What the messages of a bag say about the last training in it.

    description: of the last world, None without one.
    method: its name, `learner` before a description of the learner.
    progress, episodes: by iteration; by run and episode.
    trust, policy: the last confidence map, and the last policy of the mentor.
    advice, visited: last recommended action by state; states that were observed.
    """

    def __init__(self) -> None:
        self.description: WorldDescription | None = None
        self.method = 'learner'
        self._reset()

    def _reset(self) -> None:
        self.progress: dict[int, Progress] = {}
        self.episodes: dict[tuple[int, int], Episode] = {}
        self.trust: Trust | None = None
        self.policy: Policy | None = None
        self.advice: dict[int, int] = {}
        self.visited: set[int] = set()

    def add(self, topic: str, msg: Any) -> None:
        """Take the next message of the bag."""
        if topic == 'world':
            if self.description and msg.sha256 != self.description.sha256:
                self._reset()
            self.description = msg
        elif topic == 'method':
            if msg.turns == 0 and self.progress:
                self._reset()  # a learner that was reset, or another one
            self.method = msg.method
        elif topic == 'progress':
            self.progress[msg.iteration] = msg
        elif topic == 'episode':
            self.episodes[msg.run, msg.episode] = msg
        elif topic == 'trust':
            self.trust = msg
        elif topic == 'mentor_policy':
            self.policy = msg
        elif topic == 'recommendation':
            self.advice[msg.state] = msg.action
        elif topic == 'state':
            self.visited.add(msg.state)


def main(argv: list[str]) -> int:
    """Run the command; return the exit code."""
    parser = bag_parser('plot', 'Draw learning curve, trust map and episode lengths of a bag.')
    parser.add_argument('--out', metavar='DIR', help='(default: BAG-pictures, beside the bag)')
    options = parser.parse_args(argv[1:])
    return guarded('plot', (BagError, OutputError, PlanningError), lambda: run(options))


def run(options: argparse.Namespace) -> int:
    """Read a bag, write the pictures and print their paths; return the exit code."""
    messages, training = DecodedMessages(Bag(options.bag), options.namespace), RecordedTraining()
    for topic, msg in with_progress(messages, 'plot'):
        training.add(topic, msg)
    path = messages.bag.path.resolve()
    folder = prepare_folder(options.out or path.with_name(f'{path.stem}-pictures'))
    pictures = draw(training, folder)
    if not pictures:
        raise BagError(f'bag {options.bag!r} has no episode, progress or trust to draw')
    for picture in pictures:
        print(picture)
    return 0


def draw(training: RecordedTraining, folder: Path) -> list[Path]:
    """Draw what was recorded; return the paths of the pictures."""
    if training.description is None:
        return []
    world = world_from_description(training.description)
    advice, pictures = _advice(training, world), []
    summary = {'method': training.method, 'map': training.description.name,
               'mentor': 'as recorded',
               'episodes': max((each.episodes for each in training.progress.values()), default=0)}
    if training.progress:
        reference = ReferenceReturns(world)
        summary['optimal_return'] = reference.optimal_return
        summary['mentor_return'] = None if advice is None else reference.return_of(advice)
        curve = [training.progress[number].mean_return if number in training.progress else np.nan
                 for number in range(1, max(training.progress) + 1)]  # nan: not in the bag
        pictures.append(folder / 'learning_curve.png')
        training_plots.draw_learning_curve(pictures[-1], np.array([curve]), summary)
    states = len(world.terminal)
    if training.trust and len(training.trust.confidence) == states and advice is not None:
        pictures.append(folder / 'trust_map.png')
        visited = np.isin(np.arange(states), list(training.visited))
        training_plots.draw_trust_map(pictures[-1], world, advice,
                                      np.array(training.trust.confidence), visited, summary)
    if training.episodes:
        pictures.append(folder / 'episode_lengths.png')
        training_plots.draw_episode_lengths(pictures[-1], list(training.episodes.values()),
                                            world.grid.step_limit, summary)
    return pictures


def _advice(training: RecordedTraining, world: World) -> NDArray[np.int8] | None:
    """`advice[s]` by the mentor's policy, else by its recommendations; None without any."""
    states = len(world.terminal)
    advice = np.full(states, NO_ACTION, dtype=np.int8)
    if training.policy and len(training.policy.action) == states:
        advice[:] = training.policy.action
    else:
        for state, action in training.advice.items():
            if state < states:
                advice[state] = action
    possible = (advice >= 0) & (advice < 4) & world.free
    possible[possible] = world.available[np.flatnonzero(possible), advice[possible]]
    return np.where(possible, advice, NO_ACTION).astype(np.int8) if possible.any() else None
