# SPDX-License-Identifier: Apache-2.0
"""Worlds without a grid: small ones whose numbers can be worked out by hand, and random ones."""

from hypothesis import strategies as st
import numpy as np

from comply_ros.world.transition_table import Table

LAKE = ('SFFFFFFF', 'FFFFFFFF', 'FFFHFFFF', 'FFFFFHFF', 'FFFHFFFF', 'FHHFFFHF', 'FHFFHFHF',
        'FFFHFFFG')
DELTAS = ((0, -1), (1, 0), (0, 1), (-1, 0))  # of left, down, right, up: (row, column)


def machine(limit=50, repair=-5.0, **changes):
    """
    Return a machine with the states on, worn and off, and the actions run, stop and repair.

    Running earns 2, but wears it in half of the cases; a worn one earns 1 and breaks (off) for -4
    in a quarter of them. It can be repaired for 5; stopping ends it for nothing.
    """
    fields = {
        'actions': ('run', 'stop', 'repair'),
        'first': np.array([0, 2, 3, 3, 5, 6, 7, 7, 7, 7]),
        'successor': np.array([0, 1, 2, 1, 2, 2, 0], dtype=np.int32),
        'probability': np.array([0.5, 0.5, 1.0, 0.75, 0.25, 1.0, 1.0]),
        'reward': np.array([2.0, 2.0, 0.0, 1.0, -4.0, 0.0, repair]),
        'terminal': np.array([False, False, True]), 'starts': (0,), 'step_limit': limit}
    return Table(**{**fields, **changes})


def hall(length, n_actions, limit=200):
    """Return states in a row, the last one terminal; action 0 goes back, the last one goes on."""
    transitions = [[[(1.0, min(max(s + (a == n_actions - 1) - (a == 0), 0), length - 1),
                      -1.0, s == length - 2 and a == n_actions - 1)] for a in range(n_actions)]
                   for s in range(length - 1)]
    return Table.from_transitions([*transitions, [[] for _ in range(n_actions)]], (0,), limit)


def frozen_lake(rows=LAKE):
    """Return a slippery lake: a move goes where it was meant, or to either side, equally often."""
    size, transitions = len(rows), {}
    for row in range(size):
        for column in range(size):
            s = row * size + column
            transitions[s] = {a: _slide(rows, row, column, a) for a in range(4)}
    return Table.from_transitions(transitions, (0,), 200, ('left', 'down', 'right', 'up'))


def _slide(rows, row, column, action):
    size = len(rows)
    if rows[row][column] in 'GH':
        return [(1.0, row * size + column, 0.0, True)]
    outcomes = []
    for taken in ((action - 1) % 4, action, (action + 1) % 4):
        y, x = (min(max(here + delta, 0), size - 1)
                for here, delta in zip((row, column), DELTAS[taken]))
        outcomes.append((1 / 3, y * size + x, float(rows[y][x] == 'G'), rows[y][x] in 'GH'))
    return outcomes


@st.composite
def tables(draw, most_states=6, most_actions=5, n_actions=None):
    """
    Draw a random table in which every action can end the episode.

    Each action leads to up to three states, and to the terminal one, the last, with a
    probability of at least a tenth; some actions are missing, but never the first.

    n_actions: their number, None for any one up to the most.
    """
    states = draw(st.integers(1, most_states))
    n_actions = n_actions or draw(st.integers(1, most_actions))
    generator = np.random.default_rng(draw(st.integers(0, 2 ** 32 - 1)))
    transitions = []
    for _ in range(states):
        row = []
        for a in range(n_actions):
            number = int(generator.integers(0, 4))
            shares = generator.dirichlet(np.ones(number + 1)) * 0.9
            shares[-1] += 0.1
            rewards = generator.integers(-5, 6, number + 1).tolist()
            successors = generator.choice(states, number).tolist()
            exists = a == 0 or generator.random() < 0.8
            row.append([(p, s2, r, False) for p, s2, r in zip(shares, successors, rewards)]
                       + [(shares[-1], states, rewards[-1], True)] if exists else [])
        transitions.append(row)
    starts = sorted(set(generator.integers(0, states, 2).tolist()))
    return Table.from_transitions([*transitions, [[]] * n_actions], starts, 30)
