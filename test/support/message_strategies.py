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
    Episode,
    Progress,
    Recommendation,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import Grid

FAR = 1_000_000  # episodes ahead, which no test comes to
LARGEST = 2 ** 32
odd = st.sampled_from([float('nan'), float('inf'), float('-inf')])
numbers = st.one_of(odd, st.floats())
naturals = st.one_of(st.sampled_from([0, 1, LARGEST // 2, LARGEST - 1]),
                     st.integers(0, LARGEST - 1))
int16s = st.integers(-2 ** 15, 2 ** 15 - 1)
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
wild_advice = replaced({'state': naturals, 'action': int16s})
unknown = st.one_of(st.integers(-2 ** 15, -2), st.integers(4, 2 ** 15 - 1))
advice = st.one_of(
    then(wild_advice, another_run), another_run, ahead, then(wild_advice, ahead),
    replaced({'state': st.integers(100_000, LARGEST - 1), 'action': int16s}),
    replaced({'action': unknown}),
    then(past, replaced({'episode': st.just(0), 'state': naturals, 'action': int16s})))
wild_action = replaced({'action': int16s, 'followed': st.booleans(), 'confidence': numbers,
                        'learner': naturals})
actions = st.one_of(
    then(wild_action, another_run), another_run, ahead, then(wild_action, ahead), past,
    then(past, wild_action), replaced({'confidence': no_probability}),
    then(wild_action, replaced({'action': unknown})), replaced({'action': unknown}))


def rival(k):
    """Return a function from a world to a complete one of another run and name."""
    tiny = Grid(('.G', '..'), (0,), -1.0, -5.0, 10.0, 0.9, 20 + k % 9)
    began = (0, -2 ** 31 * 10 ** 9, 2 ** 31 * 10 ** 9 - 1)[k % 3]
    return lambda msg: describe_world(tiny, f'rival {k}', msg.run ^ (1 + k), began)


def replaced_in(part, fields):
    """Draw functions that replace fields of a tuple in a message, such as the grid of a world."""
    return st.fixed_dictionaries(fields).map(lambda values: lambda msg: msg._replace(
        **{part: getattr(msg, part)._replace(**values)}))


spoiled_world = st.one_of(
    replaced_in('grid', {'rows': st.lists(texts, max_size=4).map(tuple)}),
    replaced_in('grid', {'rows': sizes.map(lambda n: ('.' * n,) * min(n, 1000))}),
    replaced({'starts': st.lists(naturals, max_size=4).map(tuple)}),
    replaced({'starts': sizes.map(lambda n: array('I', range(n + 1)))}),
    replaced({'states': st.sampled_from([0, LARGEST - 1])}),
    replaced({'protocol': st.sampled_from([0, 1, 3, 65535])}),
    replaced({'model': st.sampled_from([0, 2, 3, 255])}),
    replaced({'actions': st.lists(texts, max_size=4).map(tuple)}),
    replaced({'cells': st.lists(texts, min_size=1, max_size=4).map(tuple)}),
    replaced({'positions': sizes.map(lambda n: array('d', [0.5] * (n + 1)))}),
    replaced_in('table', {'first': sizes.map(lambda n: array('I', range(n + 1)))}),
    *[replaced_in('grid', {name: odd}) for name in (
        'intended', 'goal_reward', 'step_reward', 'obstacle_reward')],
    replaced({'step_limit': st.sampled_from([0, LARGEST - 1])}),
    st.just(lambda msg: msg._replace(
        grid=msg.grid._replace(slips_bump=not msg.grid.slips_bump))),
    replaced({'sha256': texts.filter(bool)}),
    replaced({'name': sizes.map(lambda n: 'x' * (n + 256))}))
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
    replaced({'action': st.just([77] * 121)}), replaced({'action': st.just([-2 ** 15] * 121)}),
    replaced({'action': st.lists(int16s, max_size=9)}),
    replaced({'action': sizes.map(lambda n: array('h', bytes(2 * (122 + 10 * n))))}),
    then(replaced({'action': st.lists(int16s, max_size=121)}), another_run))
trusts = replaced({'confidence': st.lists(st.floats(width=32), max_size=9)})
