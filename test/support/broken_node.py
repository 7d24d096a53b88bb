# SPDX-License-Identifier: Apache-2.0
"""
A mentor or world of ours that breaks a rule that only a live node shows.

    python broken_node.py RULE --ros-args ...
"""

import sys

from rclpy.qos import QoSProfile

from comply_ros.nodes import grid_world, mentor, protocol_node
from comply_ros.nodes.diagnostics import Diagnostics
from comply_ros.nodes.topics import EPISODE, LATCHED, MENTOR_POLICY, RECOMMENDATION

rule = sys.argv.pop(1)
if rule == 'P1':
    mentor.RECOMMENDATION = RECOMMENDATION._replace(qos=QoSProfile(depth=1))
    mentor.MENTOR_POLICY = MENTOR_POLICY._replace(qos=QoSProfile(depth=1))
elif rule == 'P2':
    grid_world.EPISODE = EPISODE._replace(qos=LATCHED)
elif rule == 'P4':
    protocol_node.StampClock.nanoseconds = lambda clock: 0
elif rule == 'P12':
    Diagnostics.publish = lambda *arguments: None
sys.exit((grid_world if rule == 'P2' else mentor).main(sys.argv))
