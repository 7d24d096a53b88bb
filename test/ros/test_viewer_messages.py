# SPDX-License-Identifier: Apache-2.0
"""What the viewer shows of trust."""

import numpy as np
from std_msgs.msg import Header
from tiny_worlds import grid

from comply_ros.nodes.viewer_messages import GREY, mentor_message, TRUST_COLORS
from comply_ros.world.grid import NO_ACTION, RIGHT
from comply_ros.world.mdp import World


def colors(trust, learned):
    """Return the color of each arrow, left to right."""
    world, policy = World(grid('...G')), np.array([RIGHT, RIGHT, RIGHT, NO_ACTION])
    marker, = mentor_message(Header(), world, 1.0, policy, trust, learned).markers
    if not marker.colors:
        return [marker.color] * 3
    each = len(marker.points) // 3
    assert len(marker.colors) == len(marker.points)
    return [marker.colors[k] for k in range(0, 3 * each, each)]


def test_arrows_are_grey_where_the_learner_was_never():
    trust, learned = np.ones(4), np.array([NO_ACTION, RIGHT, NO_ACTION, NO_ACTION])
    assert colors(trust, learned) == [GREY, TRUST_COLORS[100], GREY]
    assert colors(trust, None) == [GREY] * 3 and colors(None, learned) == [GREY] * 3
