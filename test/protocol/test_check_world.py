# SPDX-License-Identifier: Apache-2.0
"""Our worlds pass the check of a world, and one that breaks a rule fails just that rule."""

from itertools import count

from check_channels import WorldChannel
from check_results import only, results, ROOM, unchanged
import pytest
from tiny_tables import frozen_lake
from tiny_worlds import grid

from comply_ros.protocol.check_world import RULES, world_plan, WorldCheck
from comply_ros.protocol.messages import Action, Episode, StateReward, WorldDescription
from comply_ros.protocol.rule_report import FAIL, NOT_REACHED
from comply_ros.protocol.world import WorldMachine
from comply_ros.protocol.world_moves import ModelMoves
from comply_ros.world.mdp import World

RUN = 11


def checked_world(change=unchanged, machine=WorldMachine, source=ROOM, steps=300, run=RUN,
                  make=None, **options):
    runs = count(5000)
    make = make or (lambda seed: machine(source, 'room', next(runs), seed))
    channel = WorldChannel(machine(source, 'room', run, seed=5), change, make, **options)
    return WorldCheck(channel, seed=1, plan=world_plan(steps)).run()


@pytest.mark.parametrize('source', [ROOM, frozen_lake()], ids=['grid', 'table'])
def test_our_world_passes_every_rule(source):
    assert results(checked_world(source=source, steps=2000)) == {FAIL: [], NOT_REACHED: []}


class Restless(WorldMachine):
    """Moves once, after its fourth repetition, without an action."""

    repetitions = 0

    def repeat(self, silence):
        self.repetitions += 1
        if self.repetitions == 4:
            return self._take(1)
        return super().repeat(silence)


class Skipping(WorldMachine):
    """Leaves episode 2 out."""

    def _start_episode(self, episode):
        return super()._start_episode(episode + (episode == 2))


class Changing(WorldMachine):
    """Repeats an observation with another reward, once."""

    repetitions = 0

    def repeat(self, silence):
        self.repetitions += 1
        return tuple(each._replace(reward=each.reward - 1.0) if isinstance(each, StateReward)
                     and self.repetitions == 1 else each for each in super().repeat(silence))


class Nameless(WorldMachine):
    """Gives the learner no number."""

    def on_action(self, msg):
        outputs = super().on_action(msg)
        self.observation = self.observation._replace(learner=0)
        return tuple(each._replace(learner=0) if isinstance(each, StateReward) else each
                     for each in outputs)


class Hasty(WorldMachine):
    """Accepts an action for the observation that comes after the open one."""

    def on_action(self, msg):
        observation = self.observation
        if msg.step == observation.step + 1:
            msg = msg._replace(step=observation.step)
        return super().on_action(msg)


class Patient(WorldMachine):
    """Accepts an action for an observation that was answered."""

    def on_action(self, msg):
        observation = self.observation
        if msg[:2] == observation[:2] and msg.step < observation.step:
            msg = msg._replace(step=observation.step)
        return super().on_action(msg)


class Stubborn(WorldMachine):
    """Keeps its run for a learner that is gone."""

    def repeat(self, silence):
        return super().repeat(0.0)


class Timid(WorldMachine):
    """Becomes inactive beside another world, although it was answered."""

    def on_world(self, msg, age):
        outputs = super().on_world(msg, age)
        self.inactive = True
        return outputs


class Silent(WorldMachine):
    """Does not answer another world."""

    def on_world(self, msg, age):
        return ()


class Lost(WorldMachine):
    """Does not say which run its new one replaces."""

    def reset(self, run, began):
        return tuple(each._replace(replaces=0) if isinstance(each, WorldDescription) else each
                     for each in super().reset(run, began))


class Repeating(WorldMachine):
    """Publishes an observation again after the next one."""

    def on_action(self, msg):
        before, outputs = self.observation, super().on_action(msg)
        return (*outputs, before) if self.observation != before and before.step == 2 else outputs


class Moved(WorldMachine):
    """Moves by `moves`, a change of those of the model."""

    moves = ModelMoves

    def __init__(self, source, name, run, seed):
        super().__init__(source, name, run, seed, moves=self.moves(World(source), seed))


class Teleporting(Moved):
    """Goes to state 4 with the third step of an episode."""

    class moves(ModelMoves):  # noqa: N801 - it is an attribute
        def move(self, step, s, action):
            found = super().move(step, s, action)
            return (found[0], 4, False, False) if step == 2 and s in (10, 11, 15) else found


class Greedy(Moved):
    """Pays less than it says in state 7."""

    class moves(ModelMoves):  # noqa: N801
        def move(self, step, s, action):
            reward, s2, *end = super().move(step, s, action)
            return reward - 0.5 * (s2 == 7), s2, *end


class Forgetless(Moved):
    """Goes on with its random numbers after a reset."""

    class moves(ModelMoves):  # noqa: N801
        def restart(self):
            if not hasattr(self, '_draws'):
                super().restart()


def described(**changes):
    """Return a change of the description of a world."""
    return only(WorldDescription, lambda msg: msg._replace(**changes))


def new_limit():
    """Return a change of the description into another world each time."""
    limits = count(30)
    return only(WorldDescription, lambda msg: msg._replace(step_limit=next(limits), sha256=''))


def always_5(_seed, runs=count(7000)):
    """Return a world that ignores its seed."""
    return WorldMachine(ROOM, 'room', next(runs), 5)


def replacing(seed, runs=count(8000)):
    """Return a world that says, at its start, that it replaces another one."""
    world = WorldMachine(ROOM, 'room', next(runs), seed)
    world.description = world.description._replace(replaces=77)
    return world


# Of each rule: what breaks it, as arguments of `checked_world`.
BROKEN = {
    'P6': {'machine': Patient}, 'W1': {'change': only(WorldDescription, lambda msg: None)},
    'W2': {'change': described(sha256='0' * 64)}, 'W3': {'change': new_limit()},
    'W4': {'run': 0}, 'W5': {'machine': Restless}, 'W6': {'machine': Skipping},
    'W7': {'change': only(StateReward, lambda msg: msg if msg.step else msg._replace(reward=1.0))},
    'W8': {'change': only(StateReward, lambda msg: msg._replace(terminated=False))},
    'W9': {'source': grid(*ROOM.rows, starts=(0, 4), limit=20),
           'change': described(step_limit=30, sha256='')},
    'W10': {'change': only(StateReward, lambda msg: msg._replace(state=99) if msg.step == 3
                           else msg)},
    'W11': {'machine': Changing}, 'W12': {'machine': Hasty}, 'W13': {'machine': Nameless},
    'W14': {'machine': Stubborn}, 'W15': {'change': only(Episode, lambda msg: None)},
    'W16': {'machine': Lost}, 'W17': {'make': replacing}, 'W18': {'machine': Repeating},
    'W19': {'machine': Silent}, 'W20': {'machine': Timid}, 'W21': {'machine': Teleporting},
    'W22': {'machine': Greedy}, 'W23': {'machine': Forgetless}, 'W24': {'make': always_5}}


def test_each_rule_of_a_world_has_a_world_that_breaks_it():
    assert BROKEN.keys() == RULES.keys()


@pytest.mark.parametrize('rule', BROKEN)
def test_a_world_that_breaks_a_rule_fails_just_that_rule(rule):
    assert results(checked_world(**BROKEN[rule]))[FAIL] == [rule]


@pytest.mark.parametrize('change', [
    lambda msg: msg._replace(total_reward=99.0), lambda msg: msg._replace(
        terminated=not msg.terminated)])
def test_a_report_of_an_episode_that_is_wrong_fails(change):
    assert results(checked_world(only(Episode, change)))[FAIL] == ['W15']


def test_a_report_with_a_wrong_number_of_steps_is_shown_as_it_came():
    verdicts = checked_world(only(Episode, lambda msg: msg._replace(steps=99)))
    failed, = (each for each in verdicts if each.result == FAIL)
    assert failed.rule == 'W15' and 'steps=99' in failed.got


def test_a_table_that_never_ends_is_found():
    endless = only(StateReward, lambda msg: msg._replace(terminated=False))
    assert results(checked_world(endless, source=frozen_lake()))[FAIL] == ['W8']


def test_a_world_that_another_learner_owns_is_waited_for():
    world = WorldMachine(ROOM, 'room', RUN, seed=5)
    world.on_action(Action(RUN, 1, 0, 1, False, 0.0, learner=77))
    assert results(WorldCheck(WorldChannel(world), 1, world_plan(300)).run())[FAIL] == []


def test_a_world_may_repeat_slowly():
    class Slow(WorldChannel):
        def restart_pauses(self):
            super().restart_pauses()
            self._pause, self._next = 2.0, self.time + 2.0
    world = WorldMachine(ROOM, 'room', RUN, seed=5)
    assert results(WorldCheck(Slow(world), 1, world_plan(50)).run())[FAIL] == []


def test_a_world_that_never_repeats_fails_the_rule_on_repeats():
    class Mute(WorldMachine):
        def repeat(self, silence):
            return ()
    assert results(checked_world(machine=Mute))[FAIL] == ['W11', 'W14']


def test_a_world_that_slips_more_often_than_it_says_fails_the_rule_on_its_moves():
    described = grid(*ROOM.rows, starts=(0, 4), limit=30, intended=0.95)
    real = grid(*ROOM.rows, starts=(0, 4), limit=30, intended=0.7)
    told = WorldMachine(described, 'room', RUN, seed=5).description
    verdicts = checked_world(only(WorldDescription, lambda msg: told._replace(
        run=msg.run, replaces=msg.replaces)), source=real, steps=2000)
    assert results(verdicts)[FAIL] == ['W22']


def test_no_observation_at_all_is_not_reached_but_for_the_first_rule():
    verdicts = checked_world(only(StateReward, lambda msg: None))
    found = results(verdicts)
    assert found[FAIL] == ['W1'] and len(found[NOT_REACHED]) == len(verdicts) - 1


def test_what_needs_a_reset_or_a_restart_is_not_reached_without():
    class Fixed(WorldChannel):
        def restart(self, seed):
            return False
    world = WorldMachine(ROOM, 'room', RUN, seed=5)
    found = results(WorldCheck(Fixed(world, resets=False), 1, world_plan(300)).run())
    assert found == {FAIL: [], NOT_REACHED: ['W16', 'W17', 'W23', 'W24']}


def test_a_world_without_chance_has_no_other_history_for_another_seed():
    found = results(checked_world(source=grid('..G', '...', intended=1.0)))
    assert found == {FAIL: [], NOT_REACHED: ['W24']}
