# SPDX-License-Identifier: Apache-2.0
"""A world node that publishes its reports so that a late subscriber receives the last one only."""

import sys

from comply_ros.nodes import grid_world
from comply_ros.nodes.topics import EPISODE, LATCHED

grid_world.EPISODE = EPISODE._replace(qos=LATCHED)
sys.exit(grid_world.main(sys.argv))
