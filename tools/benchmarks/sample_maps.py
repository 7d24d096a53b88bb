# SPDX-License-Identifier: Apache-2.0
"""Empty rooms of any size, the goal in a corner: what grows is the map, and nothing else."""

import yaml

from comply_ros.world.grid import Grid

STARTS = 100  # at most; spread evenly, so that all of a room is walked in
STEP_LIMIT = 320


def room(side, step_limit=STEP_LIMIT):
    """`Grid` of side x side free cells."""
    cells = side * side
    rows = ('.' * (side - 1) + 'G', *('.' * side for _ in range(side - 1)))
    spacing = max(1, cells // STARTS)
    return Grid(rows=rows, starts=tuple(range(0, cells - 1, spacing)), step_reward=-0.1,
                obstacle_reward=-0.1, goal_reward=1.0, intended=0.9, step_limit=step_limit)


def write_room(side, folder, step_limit=STEP_LIMIT):
    """Write the map of a room; return its path."""
    grid, path = room(side, step_limit), folder / f'room_{side}.yaml'
    path.write_text(yaml.safe_dump({
        'intended': grid.intended, 'step_limit': grid.step_limit,
        'rewards': {'step': grid.step_reward, 'goal': grid.goal_reward},
        'starts': [list(grid.place(s)) for s in grid.starts], 'rows': list(grid.rows)},
        default_flow_style=None, width=10 ** 9))
    return path


def write_advice(side, folder):
    """Write the advice of a mentor that says right, and up in the last column; return its path."""
    path = folder / f'advice_{side}.txt'
    path.write_text('>' * (side - 1) + 'G\n' + ('>' * (side - 1) + '^\n') * (side - 1))
    return path
