# SPDX-License-Identifier: Apache-2.0
"""The end of a session: its summary, its pictures and its table, the same for every driver."""

import numpy as np

from comply_ros.mentor.policy_text import format_policy
from comply_ros.storage.run_files import summarize, write_json
from comply_ros.terminal.console import show_table


def end_session(options, reference, advice, outcomes, paint):
    """
    Write and show what the runs of a session came to; return the summary.

    options: the `TrainingOptions`.
    yardstick: the `ReferenceReturns` of its world.
    advice: `advice[s]` of the mentor.
    outcomes: one table for each seed, with `seed, returns, steps, wall_seconds, digest`;
        `learning.npz` of the first is already in the folder.
    paint: what a `plot_process` gives.

    """
    world = reference.world
    has_mentor = options.spec.kind != 'none'
    mentor_return = reference.return_of(advice) if has_mentor else None
    singles = [summarize(options, reference, mentor_return, **each) for each in outcomes]
    summary = singles[0] if len(singles) == 1 else _lists(singles)
    files = [write_json(options.out / 'summary.json', summary), options.out / 'learning.npz',
             options.out / 'learning_curve.png']
    curves = np.array([each['returns'] for each in outcomes])
    drawn = [paint('draw_learning_curve', files[-1], curves, singles[0])]
    if has_mentor:
        files.append(options.out / 'mentor.txt')
        files[-1].write_text(format_policy(advice, world))
    if has_mentor and options.row.needs_mentor():
        files.append(options.out / 'trust_map.png')
        with np.load(options.out / 'learning.npz') as learned:
            drawn.append(paint('draw_trust_map', files[-1], world, advice,
                               learned['confidence'], learned['departures'] > 1, singles[0]))
    for picture in drawn:
        picture.result()
    show_table(singles[0], [each['seed'] for each in singles], files)
    return summary


def _lists(singles):
    """One table of many: what differs from seed to seed becomes a list."""
    always = ('seed', 'steps', 'wall_seconds', 'steps_per_second', 'return_per_iteration',
              'time_to_convergence', 'reward_ratio', 'regret', 'final_return', 'digest')
    return {key: [each[key] for each in singles] if key in always else value
            for key, value in singles[0].items()}
