# SPDX-License-Identifier: Apache-2.0
"""One step of a learner: what it chooses, and when it learns."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, room

from comply_ros.learner.choose_and_learn import choose_and_learn
from comply_ros.world.grid import DOWN, NO_ACTION, RIGHT, UP

POLICY = np.full(9, DOWN, dtype=np.int16)
SARSA = {'learning_rate': 0.5, 'learning_rate_exponent': 0.0, 'discount': 1.0,
         'trust': 'scheduled', 'confidence': 0.75}


def step(as_run, bench, learns=True, last_action=RIGHT, terminated=False, advice=UP, u_listen=0.5):
    """Come from state 3 to state 4 with reward -1, where q is 3 for UP and 1 for others."""
    bench.state.q[4], bench.state.q[4, UP] = 1.0, 3.0
    bench.state.q[3, RIGHT] = 1.0
    return as_run(choose_and_learn)(
        learns, 3, last_action, advised(NO_ACTION), -1.0, 4, 1, terminated, advised(advice),
        u_listen, 0.0, bench.kernel_config, bench.state, POLICY)


def test_it_learns_towards_the_action_that_it_chooses(as_run):  # 1 + 0.5 (-1 + 3 - 1)
    bench = Bench(room(), **SARSA)
    assert step(as_run, bench) == (UP, 0.75, 0)
    assert bench.state.q[3, RIGHT] == pytest.approx(1.5)


def test_the_end_of_an_episode_has_no_action_and_the_value_0(as_run):  # 1 + 0.5 (-1 - 1)
    bench = Bench(room(), **SARSA)
    assert step(as_run, bench, terminated=True) == (NO_ACTION, 0.0, -1)
    assert bench.state.q[3, RIGHT] == pytest.approx(0.0)


@pytest.mark.parametrize('changes', [{'learns': False}, {'last_action': NO_ACTION}])
def test_nothing_is_learned_from_what_it_did_not_do_or_only_measures(as_run, changes):
    bench = Bench(room(), **SARSA)
    assert step(as_run, bench, **changes)[1] == 0.75
    assert bench.state.q[3, RIGHT] == 1.0


def test_without_learning_it_acts_by_its_policy(as_run):
    assert step(as_run, Bench(room(), learns=False, **SARSA), learns=False) == (DOWN, 0.0, -1)
    assert step(as_run, Bench(room(), learns=False, **SARSA), learns=False,
                terminated=True) == (NO_ACTION, 0.0, -1)


@pytest.mark.parametrize(('step', 'learns', 'draws'), [
    (0, True, True), (1, True, False), (0, False, False)])
def test_psrl_draws_a_model_when_an_episode_begins(step, learns, draws):
    bench = Bench(room(), planner='psrl', discount=0.9)
    bench.state.model[4, UP, 0] = 1, 7, -1.0
    bench.state.visits[4, UP] = bench.state.departures[4] = 2.0
    choose_and_learn(learns, 0, NO_ACTION, (NO_ACTION,), 0.0, 4, step, False, (NO_ACTION,), 0.5,
                     0.0, bench.kernel_config, bench.state, POLICY)
    assert bench.state.sampled.any() == draws
