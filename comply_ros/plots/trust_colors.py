# SPDX-License-Identifier: Apache-2.0
"""The colors of a confidence: the same in pictures, in RViz, in a terminal and in a browser."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

# No, half and full confidence: red, amber, green. They differ with any kind of color vision, on
# white and on black, and none looks like the grey of arrows whose confidence is not known.
TRUST_ANCHORS = ('#CC3311', '#F0B840', '#009E73')
XTERM_LEVELS = (0, 95, 135, 175, 215, 255)  # of red, green and blue in xterm's color cube


def palette(anchors: Sequence[str]) -> NDArray[np.float64]:
    """`c[p]` = (red, green, blue) in [0, 1] for p from 0 to 100 percent of a scale of colors."""
    known = np.array([list(bytes.fromhex(anchor[1:])) for anchor in anchors]) / 255
    places = np.linspace(0, 100, len(anchors))
    return np.stack([np.interp(np.arange(101), places, each) for each in known.T], axis=-1)


TRUST_PALETTE = palette(TRUST_ANCHORS)


def trust_color(confidence: float) -> str:
    """Color of a confidence in [0, 1] as `#rrggbb`."""
    return '#' + bytes(np.rint(255 * _trust_rgb(confidence)).astype(np.uint8)).hex()


def xterm_trust_color(confidence: float) -> int:
    """Color of a confidence in [0, 1] among the 256 of a terminal: the nearest of the cube."""
    levels = (np.array(XTERM_LEVELS) / 255) ** 2.2  # light, not signal: red must not turn brown
    red, green, blue = np.abs(_trust_rgb(confidence)[:, None] ** 2.2 - levels).argmin(axis=1)
    return int(16 + 36 * red + 6 * green + blue)


def _trust_rgb(confidence: float) -> NDArray[np.float64]:
    return TRUST_PALETTE[round(100 * min(max(confidence, 0.0), 1.0))]
