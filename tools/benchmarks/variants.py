# SPDX-License-Identifier: Apache-2.0
"""The same lesson by the other choices that a user has."""

import time

from tools.benchmarks.in_process import Lesson
from tools.benchmarks.interleave import ratios, Row
from tools.benchmarks.processes import measure, nodes_file, real, together

USUAL = 'nodes as they are'
KEPT = 'with a state_dir, every step in its journal'
TRAIN = 'train, in process'
JOURNAL_GOAL = 0.95


def measured(bench):
    """Return the rows of the choices, and the raw figures: steps per second."""
    seconds, folder, parameters = 0.3 if bench.quick else 4.0, bench.folder / 'choices', \
        nodes_file(bench.folder)

    def over_topics(members, parameters=parameters):
        return lambda: measure(folder, members, seconds, parameters).rate
    lesson = Lesson('beta_implicit')
    rates = bench.interleave('choices', {
        USUAL: over_topics(real()),
        KEPT: over_topics(real(), _that_keep(bench, folder)),
        'on the default executor': over_topics(real('default_executor')),
        'best effort, not reliable': over_topics(real('best_effort')),
        'three nodes in one process': over_topics(together()),
        TRAIN: lambda: lesson.rate(seconds / 10.0, time.perf_counter)})
    return rows(rates), rates


def _that_keep(bench, folder):
    """Write parameters of nodes that keep a journal in that folder; return their path."""
    place, keeps = bench.folder / 'kept', {'state_dir': str((folder / 'state').resolve())}
    place.mkdir(exist_ok=True)
    return nodes_file(place, keeps, keeps, keeps)


def rows(rates):
    """Rows of `rates[name][round]`: each choice against the nodes as they are."""
    for name, each in rates.items():
        if name != USUAL:
            yield Row(f'{name} / {USUAL}', ratios(each, rates[USUAL]),
                      JOURNAL_GOAL if name == KEPT else None)
