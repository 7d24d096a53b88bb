# SPDX-License-Identifier: Apache-2.0
"""A grid world as points in metres, percentages and colours: what a viewer draws."""

import numpy as np

from comply_ros.world.grid import NO_ACTION, STEPS

UNKNOWN, FREE, OCCUPIED = -1, 0, 100  # cells of an occupancy grid, in percent
TRUST_SCALE = ('#CC3311', '#e8d9b0', '#009E73')  # from no confidence to full
VALUE_SCALE = ('#f7fbff', '#2f7fb8')  # from the lowest value to the highest
# Of an arrow to the right, in cells, the middle of its cell at (0, 0).
DART = ((0.32, 0.0), (-0.26, 0.24), (-0.1, 0.0), (0.32, 0.0), (-0.1, 0.0), (-0.26, -0.24))
LINES = ((-0.38, 0.0), (0.42, 0.0), (0.42, 0.0), (0.22, 0.14), (0.42, 0.0), (0.22, -0.14))
CORNERS_OF_ARROW = len(DART)


def middles(states, width, cell):
    """`p[i]` = (x, y) of the middle of each state's cell in metres; cell: its side in metres."""
    states = np.asarray(states)
    return (np.stack((states % width, states // width), axis=-1) + 0.5) * cell


def arrows(states, actions, shape, width, cell):
    """
    `p[6 i + k]` = (x, y) in metres: corner k of a shape, turned to `actions[i]` in `states[i]`.

    shape: DART, two triangles, or LINES, three lines.
    """
    forward = np.array(STEPS, dtype=float)[np.asarray(actions, dtype=int)]
    left = np.stack((-forward[:, 1], forward[:, 0]), axis=-1)
    along, aside = np.array(shape).T
    corners = along[:, None] * forward[:, None] + aside[:, None] * left[:, None]
    return (middles(states, width, cell)[:, None] + corners * cell).reshape(-1, 2)


def heading(s, s2, width):
    """Angle in which s2 lies from s, in radians from x to y; None where they are the same."""
    dx, dy = s2 % width - s % width, s2 // width - s // width
    return float(np.arctan2(dy, dx)) if dx or dy else None


def occupancy(world):
    """`o[s]`, list of int: 100 at an obstacle, 0 elsewhere."""
    return np.where(world.obstacle, OCCUPIED, FREE).tolist()


def trust_percent(world, confidence):
    """`o[s]`, list of int: confidence in percent where one can stand and act, -1 elsewhere."""
    return np.where(world.free, percent(confidence), UNKNOWN).tolist()


def percent(shares):
    """Shares in [0, 1] as whole numbers of percent, int64."""
    return np.rint(100.0 * np.asarray(shares, dtype=float)).astype(int)


def value_percent(world, values):
    """`v[i]`, int: where the value of each free state lies between the lowest and highest."""
    there = np.asarray(values, dtype=float)[world.free]
    low, high = there.min(), there.max()
    return percent((there - low) / (high - low)) if high > low else np.full(len(there), 50)


def advised(world, policy):
    """States in which one can stand and the policy has an action."""
    return np.flatnonzero(world.free & (np.asarray(policy) != NO_ACTION))


def palette(scale):
    """`c[p]` = (red, green, blue) in [0, 1] for 0 to 100 percent of a scale of colours."""
    anchors = np.array([[int(colour[i:i + 2], 16) / 255.0 for i in (1, 3, 5)]
                        for colour in scale])
    places = np.linspace(0, 100, len(scale))
    return np.stack([np.interp(np.arange(101), places, each) for each in anchors.T], axis=-1)
