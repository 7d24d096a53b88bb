# SPDX-License-Identifier: Apache-2.0
"""Choice of the next action: every formula by an example worked by hand."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, corridor, FOUR, room

from comply_ros.learner.action_choice import (
    choose,
    epsilon_greedy_action,
    policy_action,
    softmax_action,
    softmax_action_of_many,
)
from comply_ros.numerics.action_values import actions_for_kernels
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


# (2.24) with q = (1, 2, -inf, 0), temperature 0.5: weights e^-2, 1, 0, e^-4 = 0.1353353, 1, 0,
# 0.0183156; their sum is 1.1536509, so the shares end at 0.1173105, 0.9841238, 0.9841238, 1.
@pytest.mark.parametrize('u, action', [
    (0.0, LEFT), (0.11731, LEFT), (0.11732, RIGHT), (0.98412, RIGHT), (0.98413, UP),
    (0.9999999999999999, UP)])
def test_softmax_shares(as_run, u, action):
    q = np.array([[1.0, 2.0, -np.inf, 0.0]])
    assert as_run(softmax_action)(0, -1, u, 0.5, q, FOUR) == action


# The same without RIGHT: e^0, e^-2 of (1, 0): shares end at 0.8807971 and 1.
@pytest.mark.parametrize('u, action', [(0.88, LEFT), (0.8808, UP)])
def test_softmax_without_the_excluded_action(as_run, u, action):
    q = np.array([[1.0, 2.0, -np.inf, 0.0]])
    assert as_run(softmax_action)(0, RIGHT, u, 0.5, q, FOUR) == action


def test_a_cold_softmax_is_greedy(as_run):
    q = np.array([[1.0, 1.001, -np.inf, 0.0]])
    for u in (0.0, 0.5, 0.9999999999999999):
        assert as_run(softmax_action)(0, -1, u, 1e-9, q, FOUR) == RIGHT


def test_a_state_with_no_other_action_gives_the_excluded_one(as_run):
    assert as_run(softmax_action)(0, RIGHT, 0.5, 1.0, Bench(corridor()).state.q, FOUR) == RIGHT


@pytest.mark.parametrize('q, excluded, action', [
    ([0.0, 0.0, 0.0, 0.0], -1, UP), ([0.0, 0.0, 0.0, -np.inf], -1, DOWN),
    ([0.0, 0.0, -np.inf, -np.inf], -1, RIGHT), ([0.0, -np.inf, -np.inf, -np.inf], -1, LEFT),
    ([0.0, 0.0, 0.0, 0.0], UP, DOWN), ([0.0, 0.0, -np.inf, 0.0], UP, RIGHT)])
def test_rounding_never_chooses_an_action_without_weight(as_run, q, excluded, action):
    # u = 1 stands for a u below 1 whose product with the sum of the weights is rounded up to it.
    assert as_run(softmax_action)(0, excluded, 1.0, 1.0, np.array([q]), FOUR) == action


# q = (1, 2, -inf, 2), epsilon 0.3: by chance one of three actions (0.1 each), else RIGHT or UP.
@pytest.mark.parametrize('u, excluded, action', [
    (0.0, -1, LEFT), (0.0999, -1, LEFT), (0.1001, -1, RIGHT), (0.2001, -1, UP),
    (0.3001, -1, RIGHT), (0.6499, -1, RIGHT), (0.6501, -1, UP),
    (0.9999999999999999, -1, UP),
    (0.1499, RIGHT, LEFT), (0.1501, RIGHT, UP), (0.9, RIGHT, UP)])
def test_epsilon_greedy_takes_any_action_by_chance_and_else_a_best_one(as_run, u, excluded,
                                                                       action):
    q = np.array([[1.0, 2.0, -np.inf, 2.0]])
    assert as_run(epsilon_greedy_action)(0, excluded, u, 0.3, q, FOUR) == action


def test_with_epsilon_1_every_action_is_by_chance(as_run):
    q = np.array([[1.0, 2.0, 0.0, -np.inf]])
    found = [as_run(epsilon_greedy_action)(0, -1, u, 1.0, q, FOUR) for u in (0.3, 0.6, 0.9)]
    assert found == [LEFT, RIGHT, DOWN]


def test_epsilon_greedy_in_a_state_with_no_other_action_gives_the_excluded_one(as_run):
    q = Bench(corridor()).state.q
    assert as_run(epsilon_greedy_action)(0, RIGHT, 0.5, 0.1, q, FOUR) == RIGHT


@pytest.mark.parametrize('epsilon, action', [(0.0, LEFT), (0.1, RIGHT)])
def test_a_method_with_epsilon_does_not_draw_by_the_softmax(as_run, epsilon, action):
    bench = Bench(room(), epsilon=epsilon, temperature=1e6)
    bench.state.q[4, RIGHT] = 1.0  # a hot softmax draws by chance
    assert as_run(choose)(
        4, advised(-1), 0, 0.5, 0.11, bench.kernel_config, bench.state)[0] == action


# (3.2), (3.7): the advice with probability p, else the own choice
@pytest.mark.parametrize('u_listen, excludes, action', [
    (0.8999, False, DOWN), (0.9, False, DOWN), (0.9, True, LEFT)])
def test_the_advice_is_followed_with_probability_p(as_run, u_listen, excludes, action):
    bench = Bench(room(), trust='scheduled', confidence=0.9, excludes_refused=excludes,
                  temperature=1e-9)
    bench.state.q[4] = [1.0, 0.0, 2.0, 0.5]
    assert as_run(choose)(
        4, advised(DOWN), 0, u_listen, 0.5, bench.kernel_config, bench.state) == (action, 0.9, 0)


@pytest.mark.parametrize('settings, advice', [
    ({'trust': 'scheduled', 'excludes_refused': True}, -1), ({'trust': 'none'}, LEFT)])
def test_without_advice_or_trust_the_choice_is_its_own(as_run, settings, advice):
    bench = Bench(room(), temperature=1e-9, **settings)
    bench.state.q[4] = [1.0, 0.0, 2.0, 0.5]
    assert as_run(choose)(
        4, advised(advice), 0, 0.0, 0.5, bench.kernel_config, bench.state) == (DOWN, 0.0, -1)


@pytest.mark.parametrize(('epsilon', 'action'), [(0.0, DOWN), (0.6, LEFT)])
def test_a_planner_takes_the_best_action_unless_it_has_an_epsilon(as_run, epsilon, action):
    bench = Bench(room(), planner='r_max', epsilon=epsilon)
    bench.state.q[4] = [1.0, 0.0, 2.0, 0.5]
    assert as_run(choose)(
        4, advised(-1), 0, 0.0, 0.1, bench.kernel_config, bench.state) == (action, 0.0, -1)


# As for four actions above, with a fifth of the value 1: weights e^-2, 1, 0, e^-4, e^-2 with the
# sum 1.2889862: shares end at 0.1049937, 0.8807971, 0.8807971, 0.8950063, 1.
@pytest.mark.parametrize('n_actions', [5, 20])
@pytest.mark.parametrize('u, action', [
    (0.0, 0), (0.10499, 0), (0.105, 1), (0.88079, 1), (0.8808, 3), (0.895, 3), (0.89501, 4),
    (1.0, 4)])
def test_softmax_shares_of_other_numbers_of_actions(as_run, n_actions, u, action):
    q = np.full((1, n_actions), -np.inf)
    q[0, :5] = 1.0, 2.0, -np.inf, 0.0, 1.0
    actions = actions_for_kernels(n_actions)
    assert as_run(softmax_action)(0, -1, u, 0.5, q, actions) == action


def test_one_action_is_always_taken(as_run):
    q, one = np.zeros((1, 1)), actions_for_kernels(1)
    for u, excluded in ((0.0, -1), (0.99, -1), (0.5, 0)):
        assert as_run(softmax_action)(0, excluded, u, 1.0, q, one) == 0


def test_the_softmax_of_many_has_the_bits_of_that_of_four(as_run):
    generator = np.random.default_rng(0)
    four, many = as_run(softmax_action), as_run(softmax_action_of_many)
    for _ in range(2000):
        q = generator.normal(0, 3, (1, 4))
        q[0, generator.random(4) < 0.2] = -np.inf
        arguments = (0, int(generator.integers(-1, 4)), generator.random(),
                     float(generator.choice([1e-9, 0.1, 1.0])), q, FOUR)
        assert four(*arguments) == many(*arguments)


@pytest.mark.parametrize('u, action', [(0.0, 1), (0.49, 1), (0.5, 4), (0.999, 4)])
def test_without_a_policy_any_action_of_the_state_is_taken(as_run, u, action):
    q = np.array([[-np.inf, 0.0, -np.inf, -np.inf, 3.0]])
    none = np.array([-1], dtype=np.int8)
    assert as_run(policy_action)(0, u, none, q, actions_for_kernels(5)) == action
