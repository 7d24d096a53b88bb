# SPDX-License-Identifier: Apache-2.0
"""Which of three mentors counts, and what is learned of each, by examples worked by hand."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, room

from comply_ros.learner.action_choice import choose
from comply_ros.learner.confidence import (
    apply_advice_prior,
    confidence_map,
    exploration_probability,
    trusted_advice,
)
from comply_ros.learner.update_rules import learn
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP

ROWS = (4, 13, 22)  # of the belief in each of three mentors in state 4 of nine
FIRST_IN_DOUBT = 0.999999  # a u_listen above the confidence


def three(**settings):
    """Return a bench in the room, with three mentors."""
    return Bench(room(), 3, **settings)


def chosen(as_run, bench, *advice, u_listen=0.0, u_act=0.0):
    """Return the action in state 4, the confidence, and whose advice counts."""
    return as_run(choose)(4, advised(*advice), 0, u_listen, u_act, bench.kernel_config,
                          bench.state)


def learned(as_run, bench, *advice, s=4, r=-1.0, done=False):
    """Learn from (s, RIGHT, r, 5, UP) where the mentors advise this."""
    as_run(learn)(s, RIGHT, r, 5, UP, done, advised(*advice), 0.0, bench.kernel_config,
                  bench.state)


def test_the_mentor_counts_in_whom_the_confidence_is_highest(as_run):
    bench = three(trust='beta')
    bench.state.belief[ROWS, :2] = [(8.0, 2.0), (9.0, 1.0), (1.0, 3.0)]
    assert chosen(as_run, bench, LEFT, DOWN, UP) == (DOWN, 0.9, 1)
    assert bench.state.confidences.tolist() == [0.8, 0.9, 0.25]
    assert chosen(as_run, bench, LEFT, -1, UP) == (LEFT, 0.8, 0)
    assert bench.state.confidences.tolist() == [0.8, 0.0, 0.25]
    assert chosen(as_run, bench, -1, -1, UP) == (UP, 0.25, 2)


def test_without_any_advice_the_choice_is_its_own(as_run):
    bench = three(trust='beta', temperature=1e-9)
    bench.state.q[4] = [0.0, 0.0, 1.0, 0.0]
    assert chosen(as_run, bench, -1, -1, -1) == (DOWN, 0.0, -1)


def test_only_the_advice_that_counts_is_excluded_where_it_is_refused(as_run):
    bench = three(trust='beta', temperature=1e-9, excludes_refused=True)
    bench.state.belief[ROWS, :2] = [(8.0, 2.0), (9.0, 1.0), (1.0, 3.0)]
    bench.state.q[4] = [0.0, 3.0, 5.0, 2.0]
    assert chosen(as_run, bench, RIGHT, DOWN, UP, u_listen=0.95) == (RIGHT, 0.9, 1)


@pytest.mark.parametrize('q, advice, mentor', [
    ([1.0, 3.0, 2.0, 0.0], (LEFT, RIGHT, DOWN), 1),  # the highest value
    ([1.0, 3.0, 2.0, 0.0], (LEFT, -1, DOWN), 2),
    ([3.0, 1.0, 2.0, 0.0], (RIGHT, LEFT, RIGHT), 1),  # the value counts before the votes
    ([1.0, 1.0, 1.0, 9.0], (LEFT, RIGHT, RIGHT), 1),  # the most votes
    ([1.0, 1.0, 1.0, 9.0], (LEFT, RIGHT, DOWN), 0),   # the first
    ([1.0, 1.0, 1.0, 9.0], (-1, RIGHT, DOWN), 1),
    ([1.0, 1.0, 1.0, 9.0], (LEFT, LEFT, LEFT), 0)])
def test_of_equal_confidences_value_then_votes_then_the_order_decide(as_run, q, advice, mentor):
    bench = three(trust='scheduled', confidence=0.9)
    bench.state.q[4] = q
    assert chosen(as_run, bench, *advice) == (advice[mentor], 0.9, mentor)


def test_where_records_are_kept_the_best_one_decides_before_the_value(as_run):
    bench = three(trust='head_start')
    bench.state.q[4], bench.state.visits[4] = [3.0, 3.0, 1.0, 0.0], 2.0  # all were tried
    bench.state.advice_agreed[:], bench.state.advice_seen[:] = [1.0, 3.0, 2.0], [4.0, 4.0, 2.0]
    # The third has the best record, but its advice is not the best action: the confidence is 0.
    assert chosen(as_run, bench, LEFT, RIGHT, UP) == (RIGHT, 1.0, 1)
    assert chosen(as_run, bench, LEFT, -1, UP) == (LEFT, 1.0, 0)


def test_each_mentor_has_a_beta_belief_of_its_own(as_run):  # (3.8), (4.2)
    # The target is -1 + 0.9 * 4 = 2.6: delta is 0.6 for LEFT and RIGHT, 1.6 for DOWN.
    # beta + 8/10 * 0.6; alpha + 2/10 * 0.6; beta + 8/10 * 1.6
    bench = three(trust='beta', trust_rate=1.0, discount=0.9)
    bench.state.q[4], bench.state.q[5, UP] = [2.0, 2.0, 1.0, 2.0], 4.0
    learned(as_run, bench, LEFT, RIGHT, DOWN)
    state = bench.state
    assert state.belief[ROWS, :2] == pytest.approx(np.array([
        (8.0, 2.48), (8.12, 2.0), (8.0, 3.28)]))
    assert np.delete(state.belief, ROWS, axis=0).tolist() == 24 * [[8.0, 2.0, 0.0]]
    assert state.pool_size.tolist() == [2.0, 2.0, 2.0]
    assert state.pool_listen == pytest.approx([16.0, 16.12, 16.0])
    assert state.pool_discard == pytest.approx([4.48, 4.0, 5.28])


def test_the_belief_in_a_mentor_that_said_nothing_stays(as_run):
    bench = three(trust='beta', trust_rate=1.0, discount=0.9)
    learned(as_run, bench, -1, RIGHT, -1)
    assert bench.state.belief[ROWS, :2].tolist()[::2] == 2 * [[8.0, 2.0]]
    assert bench.state.belief[13].tolist() != [8.0, 2.0, 0.0]
    assert bench.state.pool_size.tolist() == [1.0, 2.0, 1.0]


def test_each_mentor_has_values_of_listening_and_discarding_of_its_own(as_run):  # (3.12)
    # q(4, RIGHT) becomes 2 + 0.5 (2.6 - 2) = 2.3. LEFT and DOWN were not taken: discarding is
    # 0.9 * 0.5 + 0.1 * 2.3; RIGHT was: listening is 0.9 * 1 + 0.1 * 2.3.
    bench = three(trust='explicit', trust_rate=0.1, updates_both=False, belief_listen=1.0,
                  belief_discard=0.5, learning_rate=0.5, discount=0.9)
    bench.state.q[4], bench.state.q[5, UP] = [2.0, 2.0, 1.0, 2.0], 4.0
    learned(as_run, bench, LEFT, RIGHT, -1)
    assert bench.state.belief[ROWS, :2] == pytest.approx(np.array([
        (1.0, 0.68), (1.13, 0.5), (1.0, 0.5)]))


def test_each_mentor_has_a_prior_that_is_learned_of_it_alone(as_run):
    # The second goes from (8, 2) to (8 - 2 * 0.2 * 10, 2) in state 0: its pool is (12, 4), and its
    # first belief in another state 10 * (12, 4) / 16.
    bench = three(trust='beta', trust_rate=2.0, learns_prior=True)
    learned(as_run, bench, -1, RIGHT, -1, s=0, r=-10.0, done=True)
    as_run(apply_advice_prior)(4, advised(UP, RIGHT, -1), bench.kernel_config, bench.state)
    assert bench.state.belief[ROWS, :2] == pytest.approx(np.array([
        (8.0, 2.0), (7.5, 2.5), (8.0, 2.0)]))


def test_each_mentor_gives_what_it_advises_a_head_start_once(as_run):
    bench = three(trust='head_start', belief_listen=0.5, belief_discard=0.0, initial_value=3.0)
    for _ in range(2):
        as_run(apply_advice_prior)(4, advised(UP, UP, LEFT), bench.kernel_config, bench.state)
    state = bench.state
    assert state.q[4].tolist() == [3.5, 3.0, 3.0, 4.0]
    assert state.advice_seen.tolist() == [3.0, 3.0, 3.0]
    assert state.advice_agreed.tolist() == [3.0, 3.0, 1.0]  # LEFT was never the best action
    as_run(apply_advice_prior)(3, advised(-1, UP, -1), bench.kernel_config, state)
    assert state.advice_seen.tolist() == [3.0, 4.0, 3.0]


def test_it_explores_as_far_as_all_that_advise_may_be_wrong(as_run):
    bench = three(trust='head_start', exploration_probability=0.4)
    bench.state.advice_agreed[:], bench.state.advice_seen[:] = [2.0, 1.0, 1.0], [3.0, 4.0, 2.0]
    found = [as_run(exploration_probability)(advised(*advice), bench.kernel_config, bench.state)
             for advice in ((UP, UP, -1), (UP, LEFT, DOWN), (-1, -1, DOWN), (-1, -1, -1))]
    # 0.4 times the shares of other advice: 1/3 * 3/4, 1/3 * 3/4 * 1/2, 1/2, all
    assert found == pytest.approx([0.1, 0.05, 0.2, 0.4])


def shaping(**settings):
    """Return a bench with q (1, 2, -inf, 0), temperature 0.5: weights e^-2, 1, 0, e^-4."""
    bench = three(trust='shaping', temperature=0.5, **settings)
    bench.state.q[4] = [1.0, 2.0, -np.inf, 0.0]
    return bench


def test_policy_shaping_multiplies_the_odds_of_all_mentors(as_run):
    # C 0.9. RIGHT has 0.9^2 * 0.1, UP 0.1^2 * 0.9 e^-4 = 0.00016484, LEFT 0.1^3 e^-2 = 0.00013534;
    # their sum is 0.08130018: 0.9963078 and 0.0020276 of it are for RIGHT and UP.
    bench = shaping(confidence=0.9, excludes_refused=True)
    action, p, mentor = chosen(as_run, bench, RIGHT, UP, RIGHT)
    assert (action, mentor) == (RIGHT, 0) and p == pytest.approx(0.9963078, abs=1e-7)
    assert bench.state.confidences == pytest.approx([0.9963078, 0.0020276, 0.9963078], abs=1e-7)
    # Not followed: LEFT with 13534 / (13534 + 16484) = 0.45085, else UP.
    for u_act, other in ((0.4508, LEFT), (0.4509, UP), (0.9999999, UP)):
        assert chosen(as_run, bench, RIGHT, UP, RIGHT, u_listen=FIRST_IN_DOUBT,
                      u_act=u_act)[0] == other


def test_mentors_of_one_opinion_shape_more_than_one(as_run):  # 0.9^2 / (0.9^2 + 3 * 0.1^2)
    bench = three(trust='shaping', confidence=0.9)
    assert chosen(as_run, bench, LEFT, LEFT, -1)[1] == pytest.approx(0.81 / 0.84)
    assert chosen(as_run, bench, -1, LEFT, -1)[1] == pytest.approx(0.9 / 1.2)
    assert chosen(as_run, bench, LEFT, UP, -1)[1] == pytest.approx(0.09 / 0.2)


@pytest.mark.parametrize('excludes, u_act, action', [
    (False, 0.1173, LEFT), (False, 0.1174, RIGHT), (False, 0.9842, UP),
    (True, 0.8807, LEFT), (True, 0.8809, UP)])  # e^-2 of e^-2 + e^-4, without RIGHT
def test_mentors_that_are_never_wrong_and_disagree_leave_the_softmax(
        as_run, excludes, u_act, action):
    bench = shaping(confidence=1.0, excludes_refused=excludes)
    found, p, _ = chosen(as_run, bench, RIGHT, LEFT, -1, u_act=u_act)
    assert (found, p) == (action, 0.0)


def test_a_confidence_map_has_a_row_for_each_mentor():
    bench = three(trust='beta')
    bench.state.belief[[2, 9 + 5], :2] = [(1.0, 3.0), (1.0, 1.0)]
    p = confidence_map(bench.config, bench.state, 27 * [-1]).reshape(3, 9)
    expected = np.full((3, 9), 0.8)
    expected[0, 2], expected[1, 5] = 0.25, 0.5
    assert (p == expected).all()


def test_the_advice_that_counts_is_found_for_every_state():
    bench = three(trust='beta')
    bench.state.belief[[2, 9 + 5], :2] = [(1.0, 3.0), (1.0, 1.0)]
    bench.state.confidences[:] = 0.125
    advice = np.array([[-1, 1, 1, 1, 1, 1, 1, 1, 1], [-1, 3, 3, 3, 3, 3, 3, 3, -1], 9 * [-1]])
    p = confidence_map(bench.config, bench.state, advice.ravel())
    found, confidence = trusted_advice(bench.config, bench.state, advice.ravel(), p)
    # state 2: the second is trusted more; elsewhere values and votes are equal: the first
    assert found.tolist() == [-1, 1, 3, 1, 1, 1, 1, 1, 1]
    assert confidence[1:].tolist() == 8 * [0.8]
    assert bench.state.confidences.tolist() == 3 * [0.125]  # those of the learner stay
