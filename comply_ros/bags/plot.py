# SPDX-License-Identifier: Apache-2.0
"""`plot BAG`: what was learned, as pictures, from a bag alone."""

import numpy as np

from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.message_decoder import DecodedMessages
from comply_ros.bags.replay import bag_parser, shown, tell_cut
from comply_ros.plots.training_plots import (
    draw_episode_lengths,
    draw_learning_curve,
    draw_trust_map,
)
from comply_ros.protocol.messages import grid_from_description
from comply_ros.storage.run_files import OutputError, prepare_folder
from comply_ros.terminal.training_options import guarded
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import PlanningError, ReferenceReturns


class Reports:
    """
    What was reported of the last learning in a bag.

    Attributes
    ----------
    described: the `WorldDescription` of the last run, None where there is none.
    method: name of the method, `learner` where it was not said.
    progress: `Progress` by iteration, of the last learning.
    episodes: `Episode` by run and number, of the last learning.
    trust, advice: the last `Trust`, and the mentor's last `Policy`, of the last run.
    heard: `heard[state]`, what the mentor said last.
    visited: states that were met.

    """

    def __init__(self):
        self.described, self.method = None, 'learner'
        self._begin()

    def _begin(self):
        self.progress, self.episodes, self.visited, self.heard = {}, {}, set(), {}
        self.trust, self.advice = None, None

    def hear(self, topic, msg):
        """Take what was said next."""
        take = getattr(self, f'_on_{topic}', None)
        if take:
            take(msg)

    def _on_world(self, msg):
        if self.described and msg.sha256 != self.described.sha256:
            self._begin()
        self.described = msg

    def _on_method(self, msg):
        if msg.turns == 0 and self.progress:
            self._begin()  # it has forgotten all, or is another
        self.method = msg.method

    def _on_progress(self, msg):
        self.progress[msg.iteration] = msg

    def _on_episode(self, msg):
        self.episodes[msg.run, msg.episode] = msg

    def _on_trust(self, msg):
        self.trust = msg

    def _on_mentor_policy(self, msg):
        self.advice = msg

    def _on_recommendation(self, msg):
        self.heard[msg.state] = msg.action

    def _on_state(self, msg):
        self.visited.add(msg.state)


def main(argv):
    """Run the command; return the exit code."""
    parser = bag_parser('plot', 'Draw learning curve, trust map and episode lengths of a bag.')
    parser.add_argument('--out', metavar='DIR', help='(default: BAG-pictures, beside the bag)')
    given = parser.parse_args(argv[1:])
    return guarded('plot', (BagError, OutputError, PlanningError), lambda: run(given))


def run(given):
    """Read a bag, write and name the pictures, return the exit code."""
    conversation, reports = DecodedMessages(Bag(given.bag), given.namespace), Reports()
    for topic, msg in shown(conversation, 'plot'):
        reports.hear(topic, msg)
    tell_cut('plot', conversation.bag)
    path = conversation.bag.path.resolve()
    out = prepare_folder(given.out or path.with_name(f'{path.stem}-pictures'))
    drawn = draw(reports, out)
    if not drawn:
        raise BagError(f'bag {given.bag!r} has no episode, no iteration and no trust to draw')
    for picture in drawn:
        print(picture)
    return 0


def draw(reports, out):
    """Draw what there is; return the paths of the pictures."""
    try:
        world = World(grid_from_description(reports.described))
    except ValueError as error:
        raise BagError(f'the world of run {reports.described.run} must be whole: {error}'
                       ) from None
    advice, summary = _advice(reports, world), _summary(reports)
    drawn = []
    if reports.progress:
        reference = ReferenceReturns(world)
        summary['optimal_return'] = reference.optimal_return
        summary['mentor_return'] = None if advice is None else reference.return_of(advice)
        drawn.append(out / 'learning_curve.png')
        draw_learning_curve(drawn[-1], _curve(reports.progress), summary)
    if _fits(reports.trust, world, 'confidence') and advice is not None:
        drawn.append(out / 'trust_map.png')
        visited = np.isin(np.arange(len(world.terminal)), list(reports.visited))
        draw_trust_map(drawn[-1], world, advice, np.array(reports.trust.confidence), visited,
                       summary)
    if reports.episodes:
        drawn.append(out / 'episode_lengths.png')
        draw_episode_lengths(drawn[-1], list(reports.episodes.values()), world.grid.step_limit,
                             summary)
    return drawn


def _summary(reports):
    episodes = max((each.episodes for each in reports.progress.values()), default=0)
    return {'method': reports.method, 'map': reports.described.name, 'mentor': 'as recorded',
            'episodes': episodes}


def _curve(progress):
    """`curves[0, iteration]`: nan where an iteration is not in the bag."""
    last = max(progress)
    return np.array([[progress[number].mean_return if number in progress else np.nan
                      for number in range(1, last + 1)]])


def _advice(reports, world):
    """`advice[s]` that the mentor published, else what it was heard to say; None for nothing."""
    if _fits(reports.advice, world, 'action'):
        advice = np.array(reports.advice.action, dtype=np.int8)
    else:
        advice = np.full(len(world.terminal), NO_ACTION, dtype=np.int8)
        for state, action in reports.heard.items():
            if 0 <= state < len(advice):
                advice[state] = action
    possible = (advice >= 0) & (advice < 4) & world.free
    possible[possible] = world.available[np.flatnonzero(possible), advice[possible]]
    return np.where(possible, advice, NO_ACTION).astype(np.int8) if possible.any() else None


def _fits(msg, world, field):
    return msg is not None and len(getattr(msg, field)) == len(world.terminal)


