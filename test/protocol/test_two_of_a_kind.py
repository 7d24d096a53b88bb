# SPDX-License-Identifier: Apache-2.0
"""Two learners or two worlds on the same topics: one continues, the other becomes inactive."""

from collections import deque
from itertools import count, product

import pytest
from room_messages import advice, make_learner, ROOM, ROOM_MSG, RUN, state, types

from comply_ros.numerics import rng
from comply_ros.protocol import world as world_module
from comply_ros.protocol.messages import Action, ANYONE, Inactive, Rejected
from comply_ros.protocol.run_tracker import OWNED_BY_OTHER
from comply_ros.protocol.world import ESTABLISHED, MOST_ANSWERS, RELEASE, WorldMachine


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    """Draw few random numbers at once, since these tests make thousands of worlds."""
    monkeypatch.setattr(rng, 'ROW_BLOCK', 4)


def learner_alone(number):
    """Return a learner that needs no mentor and has received the world."""
    return make_learner(number, trust='none')


def room_world(run=RUN, began=0.0):
    """Return a room at its first observation."""
    return WorldMachine(ROOM, 'room', run, seed=0, began=began)


def test_a_run_belongs_to_the_first_learner_that_answers_and_others_are_rejected():
    world, first, second = room_world(), learner_alone(5), learner_alone(6)
    observation = world.observation
    assert observation.learner == ANYONE
    (action,), (other_action,) = first.observe(observation), second.observe(observation)
    following, = world.on_action(action)
    assert following.learner == 5
    rejected, = world.on_action(other_action)
    assert rejected.reason == ('an action must come from learner 5, which owns this run, got 6: '
                               'is there a second one?')
    assert world.observation is following


def test_a_second_learner_learns_and_publishes_nothing_and_becomes_inactive():
    world, first, second = room_world(), learner_alone(5), learner_alone(6)
    digest, outputs = second.state.digest(), ()
    while not outputs:
        observation = world.observation
        outputs = second.observe(observation._replace(learner=5))
        action, = first.observe(observation)[:1]
        world.on_action(action)
    assert types(outputs) == [Inactive]
    assert second.state.digest() == digest
    assert second.observe(world.observation._replace(learner=ANYONE)) == ()
    assert world.observation.learner == 5
    assert first.agent.steps >= OWNED_BY_OTHER - 5


def test_a_run_whose_learner_is_silent_accepts_another_one():
    world = room_world()
    world.on_action(Action(RUN, 1, 0, 1, False, 0.0, 5))
    repeated, = world.repeat(RELEASE - 0.1)
    assert repeated.learner == 5
    description, repeated = world.repeat(RELEASE + 0.1)
    assert (description, repeated.learner) == (world.description, ANYONE)
    late = learner_alone(6)
    late.observe(repeated)
    action, = late.observe(repeated)
    assert world.on_action(action)[-1].learner == 6


def test_a_learner_that_waits_for_advice_repeats_its_last_action_so_that_its_run_stays_its_own():
    learner = make_learner(number=5)
    learner.observe(state())
    first, = learner.on_recommendation(advice())
    assert learner.observe(state(step=1, s=3, reward=-1.0)) == ()
    assert learner.observe(state(step=1, s=3, reward=-1.0)) == (first,)
    world = room_world()
    world.on_action(first)
    world.on_action(first)
    assert world.learner_messages == 1


def test_a_learner_does_not_learn_from_the_move_of_another_one():
    left_out = learner_alone(6)
    left_out.observe(state())
    digest = left_out.state.digest()
    observation = state(step=1, s=1, reward=-1.0)
    assert left_out.observe(observation._replace(learner=5)) == ()
    outputs = left_out.observe(observation)  # that learner is gone, and any may answer
    assert types(outputs) == [Action]
    assert left_out.state.digest() == digest
    assert left_out.agent.steps == 0


def test_a_learner_does_not_learn_from_a_later_move_of_another_one():
    learner = learner_alone(6)
    learner.observe(state())
    assert learner.observe(state(step=2, s=0, reward=-1.0)._replace(learner=5)) == ()
    learner.observe(state(step=1, s=1, reward=-1.0))
    digest, steps = learner.state.digest(), learner.agent.steps
    assert types(learner.observe(state(step=2, s=0, reward=-1.0))) == [Action]
    assert (learner.state.digest(), learner.agent.steps) == (digest, steps)


def test_a_learner_that_was_left_out_takes_part_when_the_other_is_gone():
    left_out = learner_alone(6)
    left_out.observe(state())
    for step in range(1, 5):
        left_out.observe(state(step=step, s=1 + step % 2, reward=-1.0)._replace(learner=5))
    assert left_out.waiting_for() == ('an observation of its own: the world addresses another '
                                      'learner')
    later = state(step=5, s=2, reward=-1.0)
    for _ in range(3):
        assert [msg.kind for msg in left_out.observe(later)] == ['joins late']
    left_out.tick()
    assert types(left_out.observe(later)) == [Action]


def test_a_learner_whose_observation_is_repeated_was_not_left_out_at_a_step_id_far_ahead():
    learner, observation = learner_alone(6), state()
    learner.observe(observation)
    forged = state(episode=1_029_192, step=7, s=4, reward=-1.0)
    learner.observe(forged._replace(step=6, learner=5))
    for _ in range(9):
        learner.observe(forged)
        learner.tick()
        assert types(learner.observe(observation)) == [Action]
        learner.observe(forged._replace(step=6, learner=5))
    assert types(learner.observe(state(step=1, s=1, reward=-1.0))) == [Action]


class Rivals:
    """
    Two worlds on the same topics.

    Parameters
    ----------
    answered: whether the first observation of each was answered.
    ages: of each, in seconds, when it receives the other one; then they grow fast.
    runs: the number of each.
    began: system time at the start of each.

    """

    def __init__(self, answered, ages, runs, began=(0.0, 0.0)):
        self.worlds = [room_world(run, at) for run, at in zip(runs, began)]
        for world, was_answered in zip(self.worlds, answered):
            if was_answered:
                world.on_action(Action(world.description.run, 1, 0, 1, False, 0.0, 5))
        self._ages, self._grown = ages, [count(0.0, 2.0 * ESTABLISHED) for _ in ages]
        self.outputs = [[], []]
        # what is on the way to each: at first the latched description of the other
        self._on_the_way = [deque([world.description]) for world in reversed(self.worlds)]

    def repeat(self, number):
        """Let a world publish its description again, as one does that is not answered."""
        if not self.worlds[number].inactive:
            self._on_the_way[1 - number].append(self.worlds[number].description)

    def deliver(self, order):
        """
        Deliver until nothing is on the way.

        order: which world receives next, again and again; the other one, if it has nothing to.
        """
        for turn in count():
            if not any(self._on_the_way):
                return self
            assert turn < 50, 'the worlds publish without end'
            number = order[turn % len(order)]
            number = number if self._on_the_way[number] else 1 - number
            world, msg = self.worlds[number], self._on_the_way[number].popleft()
            for output in world.on_world(msg, self._ages[number] + next(self._grown[number])):
                self.outputs[number].append(output)
                if output == world.description:
                    self._on_the_way[1 - number].append(output)

    def inactive(self):
        """Return whether each is inactive."""
        return [world.inactive for world in self.worlds]


# (answered, age when the other world is first received, rank: the higher one continues)
KINDS = {'answered': (True, 100.0, 2), 'new and answered': (True, 0.5, 2),
         'there before': (False, 100.0, 1), 'new': (False, 0.5, 0)}
ORDERS = list(product((0, 1), repeat=4))
# With the runs (8, 7), each would only be another one in a mirror: so is all that is varied here.
PAIRS = list(product(KINDS, KINDS, ((7, 8),)))


def rivals(kind, other_kind, runs, **settings):
    """Return two worlds of these kinds."""
    (answered, age, _), (other_answered, other_age, _) = KINDS[kind], KINDS[other_kind]
    return Rivals((answered, other_answered), (age, other_age), runs, **settings)


def expected_inactive(kind, other_kind, runs):
    """Return which of two worlds becomes inactive: none of two that are answered."""
    rank, other_rank = KINDS[kind][2], KINDS[other_kind][2]
    if rank == other_rank == 2:
        return [False, False]
    loses = rank < other_rank or rank == other_rank and runs[0] > runs[1]
    return [loses, not loses]


@pytest.mark.parametrize('kind, other_kind, runs', PAIRS)
def test_of_two_worlds_one_continues_in_every_order_of_their_messages(kind, other_kind, runs):
    expected = expected_inactive(kind, other_kind, runs)
    for order in ORDERS:
        pair = rivals(kind, other_kind, runs).deliver(order)
        assert pair.inactive() == expected, order


@pytest.mark.parametrize('kind, other_kind, runs', PAIRS)
@pytest.mark.parametrize('repeating', [(0,), (1,), (0, 1)])
def test_of_two_worlds_one_continues_where_they_repeat_themselves_meanwhile(
        kind, other_kind, runs, repeating):
    expected = expected_inactive(kind, other_kind, runs)
    for order in ORDERS:
        pair = rivals(kind, other_kind, runs)
        for number in repeating:
            pair.repeat(number)
        assert pair.deliver(order).inactive() == expected, order


@pytest.mark.parametrize('kind, other_kind, runs', PAIRS)
def test_it_does_not_matter_when_two_worlds_began(kind, other_kind, runs):
    expected = expected_inactive(kind, other_kind, runs)
    for began, order in product(product((-1e300, 0.0, 10.0, 1e300), repeat=2), ((0,), (1,))):
        assert rivals(kind, other_kind, runs, began=began).deliver(order).inactive() == expected


def test_an_inactive_world_publishes_nothing_and_says_why():
    pair = rivals('new', 'there before', (7, 8)).deliver((0, 1))
    second, _ = pair.worlds
    inactive, = (msg for msg in pair.outputs[0] if isinstance(msg, Inactive))
    assert inactive.reason == ("another world, 'room', came first and owns these topics for its "
                               'run 8: stop this world, or give it a namespace of its own')
    assert second.repeat(10.0) == ()
    assert second.on_action(Action(second.observation.run, 1, 0, 1, False, 0.0)) == ()
    assert second.on_world(ROOM_MSG._replace(run=9), 0.5) == ()


@pytest.mark.parametrize('age', [0.5, 100.0])
@pytest.mark.parametrize('run', [3, 9])
def test_the_last_message_of_a_world_that_is_gone_is_answered_once(run, age):
    world = room_world(8)
    assert world.on_world(ROOM_MSG._replace(run=run), age)[-1] == world.description
    assert not world.inactive


def test_a_world_does_not_answer_itself_or_the_run_that_it_replaced():
    world = room_world(7)
    world.reset(8, began=1.0)
    for run in (7, 8):
        assert world.on_world(ROOM_MSG._replace(run=run), 0.5) == ()


def test_a_world_that_is_answered_does_not_argue_for_ever(monkeypatch):
    world, read, read_grid = room_world(), [], world_module.world_from_description

    def read_and_note(msg):
        read.append(msg)
        return read_grid(msg)
    monkeypatch.setattr(world_module, 'world_from_description', read_and_note)
    world.on_action(Action(RUN, 1, 0, 1, False, 0.0, 5))
    outputs = [world.on_world(ROOM_MSG._replace(run=8), 0.5) for _ in range(MOST_ANSWERS + 5)]
    assert [len(each) for each in outputs] == [2] * MOST_ANSWERS + [0] * 5
    assert outputs[0] == (Rejected('another world', 'run 8 of another world is published here '
                                   'too: it must become inactive'), world.description)
    assert len(read) == MOST_ANSWERS  # later messages are not even read


def test_a_world_answers_no_endless_number_of_other_worlds():
    world = room_world()
    world.on_action(Action(RUN, 1, 0, 1, False, 0.0, 5))
    answers = [world.on_world(ROOM_MSG._replace(run=run), 0.5) for run in range(10, 210)]
    assert [bool(each) for each in answers] == [True] * world_module.OTHERS + [False] * (
        200 - world_module.OTHERS)


def test_a_message_that_describes_no_world_makes_no_world_inactive():
    world = room_world(8)
    for _ in range(20):
        with pytest.raises(ValueError, match='sha256 must be that of the world'):
            world.on_world(ROOM_MSG._replace(step_limit=51), 0.5)
    assert not world.inactive
