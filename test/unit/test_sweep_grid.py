# SPDX-License-Identifier: Apache-2.0
"""All combinations, by number and back."""

from comply_ros.experiments.sweep_grid import Sweep
from comply_ros.experiments.training_runs import Run

SWEEP = Sweep({'map': ('maze',), 'profile': ('report', 'published'), 'mentor': ('none',),
               'mentor_seed': (0,), 'budget': (0, 5), 'advising': ('early',),
               'method': ('sarsa',), 'temperature': (0.5, 1.0, 2.0), 'seed': (0, 1)})


def test_the_last_axis_varies_fastest():
    assert len(SWEEP) == 24
    assert SWEEP.run(0) == Run('maze', 'report', 'sarsa', (('temperature', 0.5),), 'none')
    assert SWEEP.run(1) == SWEEP.run(0)._replace(seed=1)
    assert SWEEP.run(2) == SWEEP.run(0)._replace(settings=(('temperature', 1.0),))
    assert SWEEP.run(6) == SWEEP.run(0)._replace(budget=5)
    assert SWEEP.run(23) == Run(
        'maze', 'published', 'sarsa', (('temperature', 2.0),), 'none', budget=5, seed=1)


def test_the_number_of_a_run_is_found_by_its_texts():
    for number in range(len(SWEEP)):
        texts = {name: str(value) for name, value in SWEEP.values_of(number).items()}
        assert SWEEP.number_of(texts) == number
    assert SWEEP.number_of({**texts, 'seed': '2'}) is None
    assert SWEEP.number_of({**texts, 'temperature': 'cold'}) is None
