# SPDX-License-Identifier: Apache-2.0
"""Tiny maps of `CellRules`, and their outcomes by cells (x, y)."""

from table_planning import outcomes

from comply_ros.world.cell_rules import CellRules, Letter
from comply_ros.world.cell_rules_table import table_of

GOAL = Letter(10.0, ends=True)


def rules(*rows, start=(0, 0), legend=None, **changes):
    """Return rules of a map: a step -1, an obstacle -5, an edge -2, a wall -3, the goal 10."""
    width = len(rows[0]) if rows else 1
    fields = {'starts': (start[1] * width + start[0],), 'legend': {'G': GOAL, **(legend or {})},
              'step_reward': -1.0, 'obstacle_reward': -5.0, 'edge_reward': -2.0,
              'wall_reward': -3.0, **changes}
    return CellRules(rows=tuple(rows), **fields)


def steps(made, x, y, action):
    """Return {(x, y, reward): probability} of an action in a cell; of rules."""
    found = outcomes(table_of(made), y * made.width + x, action)
    return {(s % made.width, s // made.width, reward): round(chance, 12)
            for (s, reward), chance in found.items()}
