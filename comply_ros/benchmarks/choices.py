# SPDX-License-Identifier: Apache-2.0
"""The same lesson by the other choices that a user has."""

import time

from comply_ros.benchmarks.engine import Lesson
from comply_ros.benchmarks.fleet import measure, nodes_file, real, together
from comply_ros.benchmarks.rounds import ratios, Row

USUAL = 'nodes as they are'
TRAIN = 'train, in process'


def measured(bench):
    """Return the rows of the choices, and the raw figures: steps per second."""
    seconds, folder, parameters = 0.3 if bench.quick else 4.0, bench.folder / 'choices', \
        nodes_file(bench.folder)

    def over_topics(members):
        return lambda: measure(folder, members, seconds, parameters).rate
    lesson = Lesson('beta_implicit')
    rates = bench.interleave('choices', {
        USUAL: over_topics(real()),
        'on the default executor': over_topics(real('default_executor')),
        'best effort, not reliable': over_topics(real('best_effort')),
        'three nodes in one process': over_topics(together()),
        TRAIN: lambda: lesson.rate(seconds / 10.0, time.perf_counter)})
    return rows(rates), rates


def rows(rates):
    """Rows of `rates[name][round]`: each choice against the nodes as they are."""
    for name, each in rates.items():
        if name != USUAL:
            yield Row(f'{name} / {USUAL}', ratios(each, rates[USUAL]))
