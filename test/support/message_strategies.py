# SPDX-License-Identifier: Apache-2.0
"""
Garbage: true messages that are made wrong in at least one way, as hypothesis draws it.

Every strategy draws functions from a message that was really published to one that cannot be
right. None draws what no subscriber can tell from the truth: the run, the open step id, a
possible state or action, the right learner. Only SROS2 keeps publishers of such messages from
the topics.
"""

from array import array
from functools import partial

from hypothesis import strategies as st

from comply_ros.protocol.messages import (
    Action,
    describe_world,
    Episode,
    Progress,
    Recommendation,
    StateReward,
    WorldDescription,
)
from comply_ros.world.grid import Grid

FAR = 1_000_000  # episodes ahead, which no test comes to
LARGEST = 2 ** 32
odd = st.sampled_from([float('nan'), float('inf'), float('-inf')])
numbers = st.one_of(odd, st.floats())
naturals = st.one_of(st.sampled_from([0, 1, LARGEST // 2, LARGEST - 1]),
                     st.integers(0, LARGEST - 1))
bytes_ = st.integers(-128, 127)
sizes = st.sampled_from([0, 1, 2, 3, 5, 9, 11, 20, 50, 99, 200, 100_000])  # a huge one is rare
texts = st.one_of(st.sampled_from(['', '..G', '[/red]', 'x' * 10_000]), st.text(
    st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=20))
no_probability = st.one_of(odd, st.floats(max_value=-1e-9), st.floats(min_value=1.000001))


def replaced(fields):
    """Draw functions that replace these fields by values from their strategies."""
    return st.fixed_dictionaries(fields).map(lambda values: lambda msg: msg._replace(**values))


another_run = st.integers(1, LARGEST - 1).map(
    lambda k: lambda msg: msg._replace(run=msg.run ^ k))
ahead = st.tuples(st.integers(FAR, 2 * FAR), naturals).map(
    lambda k: lambda msg: msg._replace(episode=msg.episode % FAR + k[0], step=k[1]))
past = st.tuples(naturals, naturals).map(
    lambda k: lambda msg: msg._replace(episode=k[0] % max(msg.episode, 1), step=k[1]))


def then(*strategies):
    """Draw functions that apply one function of each strategy after the other."""
    def in_order(functions, msg):
        for each in functions:
            msg = each(msg)
        return msg
    return st.tuples(*strategies).map(lambda functions: partial(in_order, functions))


def flipped(name):
    """Draw a function that inverts a field that is true or false."""
    return st.just(lambda msg: msg._replace(**{name: not getattr(msg, name)}))


wild_state = replaced({'state': naturals, 'reward': numbers, 'terminated': st.booleans(),
                       'truncated': st.booleans(), 'learner': naturals})
states = st.one_of(
    then(wild_state, another_run), then(wild_state, past), then(wild_state, ahead), ahead,
    replaced({'state': st.integers(100_000, LARGEST - 1)}), replaced({'reward': odd}),
    then(wild_state, replaced({'reward': odd, 'state': naturals})),
    flipped('terminated'), flipped('truncated'),
    replaced({'step': st.integers(100_000, LARGEST - 1)}),
    then(ahead, replaced({'step': st.integers(0, 9), 'learner': naturals})),
    then(another_run, replaced({'step': st.integers(0, 9)})))
wild_advice = replaced({'state': naturals, 'action': bytes_})
unknown = st.one_of(st.integers(-128, -2), st.integers(4, 127))
advice = st.one_of(
    then(wild_advice, another_run), another_run, ahead, then(wild_advice, ahead),
    replaced({'state': st.integers(100_000, LARGEST - 1), 'action': bytes_}),
    replaced({'action': unknown}),
    then(past, replaced({'episode': st.just(0), 'state': naturals, 'action': bytes_})))
wild_action = replaced({'action': bytes_, 'followed': st.booleans(), 'confidence': numbers,
                        'learner': naturals})
actions = st.one_of(
    then(wild_action, another_run), another_run, ahead, then(wild_action, ahead), past,
    then(past, wild_action), replaced({'confidence': no_probability}),
    then(wild_action, replaced({'action': unknown})), replaced({'action': unknown}))


def rival(k):
    """Return a function from a world to a complete one of another run and name."""
    tiny = Grid(('.G', '..'), (0,), -1.0, -5.0, 10.0, 0.9, 20 + k % 9)
    began = (0.0, -1e300, 1e300)[k % 3]
    return lambda msg: describe_world(tiny, f'rival {k}', msg.run ^ (1 + k), began)


spoiled_world = st.one_of(
    replaced({'rows': st.lists(texts, max_size=4).map(tuple)}),
    replaced({'rows': sizes.map(lambda n: ('.' * n,) * min(n, 1000))}),
    replaced({'starts': st.lists(naturals, max_size=4).map(tuple)}),
    replaced({'starts': sizes.map(lambda n: array('I', range(n + 1)))}),
    replaced({'width': st.just(0)}),
    replaced({'intended': odd}), replaced({'goal_reward': odd}), replaced({'began': odd}),
    replaced({'step_reward': odd}), replaced({'obstacle_reward': odd}),
    replaced({'step_limit': st.sampled_from([0, LARGEST - 1])}), flipped('slips_bump'),
    replaced({'sha256': texts}), replaced({'name': sizes.map(lambda n: 'x' * (n + 256))}))
worlds = st.one_of(
    then(spoiled_world, another_run), spoiled_world, st.integers(0, 50).map(rival),
    st.integers(0, 50).map(lambda k: lambda msg: rival(k)(msg)._replace(run=msg.run)))
progress = st.one_of(
    then(replaced({'iteration': naturals, 'mean_return': numbers, 'finished': st.booleans()}),
         another_run),
    replaced({'mean_return': odd}), replaced({'iteration': naturals, 'mean_return': odd}),
    replaced({'temperature': odd}), replaced({'confidence': no_probability.filter(
        lambda value: value == value)}),
    st.integers(1, 5).map(lambda k: lambda msg: msg._replace(
        iteration=msg.iteration + k, mean_return=float('nan'))),
    st.integers(1, 5).map(lambda k: lambda msg: msg._replace(
        iteration=msg.iteration + k, finished=not msg.finished)),
    st.integers(1, 5).map(lambda k: lambda msg: msg._replace(iteration=msg.iteration + k)))
episodes = st.one_of(another_run, replaced({'total_reward': numbers, 'steps': naturals}))
GARBAGE = {WorldDescription: worlds, StateReward: states, Recommendation: advice, Action: actions,
           Episode: episodes, Progress: progress}
policies = st.one_of(
    replaced({'action': st.just([77] * 121)}), replaced({'action': st.just([-128] * 121)}),
    replaced({'action': st.lists(bytes_, max_size=9)}),
    replaced({'action': sizes.map(lambda n: array('b', bytes(122 + 10 * n)))}),
    then(replaced({'action': st.lists(bytes_, max_size=121)}), another_run),
    replaced({'width': naturals.filter(lambda n: n != 11)}))
trusts = replaced({'confidence': st.lists(st.floats(width=32), max_size=9), 'width': naturals})
