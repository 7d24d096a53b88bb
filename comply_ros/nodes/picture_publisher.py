# SPDX-License-Identifier: Apache-2.0
"""Pictures of an environment as messages: while somebody subscribes, and no more than it costs."""

from array import array

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image

from comply_ros.nodes.clocks import StampClock, steady_timer
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.nodes.publish_throttle import CostThrottle
from comply_ros.nodes.topics import IMAGE, IMAGE_QOS, time_message
from comply_ros.storage.gymnasium_moves import EnvironmentMoves, PictureError


class PicturePublisher:
    """
    Publishes what an environment looks like, whenever it has moved and somebody subscribes.

    A picture is drawn between two steps, so it costs time of the loop: `CostThrottle` keeps that
    below 2 %. If the environment gives no picture, the node logs why, and publishes none any more.

    Parameters
    ----------
    node: whose topic it is.
    moves: of the environment.
    rate: pictures per second, at most.

    """

    def __init__(self, node: ProtocolNode, moves: EnvironmentMoves, rate: float) -> None:
        self._node, self._moves = node, moves
        self._publisher = node.create_publisher(Image, IMAGE, IMAGE_QOS)
        self._clock, self._throttle = StampClock(node), CostThrottle(1.0 / rate)
        self._published = 0, 0  # subscribers, and steps of the environment, at the last picture
        self._timer = steady_timer(node, 1.0 / rate, self._tick)

    def _tick(self) -> None:
        subscribers = self._publisher.get_subscription_count()
        known, steps = self._published
        self._published = min(known, subscribers), steps
        now = subscribers, self._moves.used
        if subscribers == 0 or now == self._published or self._node.machine.inactive \
                or not self._throttle.is_due():
            return
        self._published = now
        try:
            self._throttle.start(self._publish)
        except PictureError as error:
            self._node.get_logger().warning(f'{error}; topic {IMAGE} ends')
            self._node.destroy_timer(self._timer)
            self._node.destroy_publisher(self._publisher)

    def _publish(self) -> None:
        msg = image_message(self._moves.picture())
        msg.header.stamp = time_message(self._clock.nanoseconds())
        self._publisher.publish(msg)


def image_message(picture: NDArray[np.uint8]) -> Image:
    """Return the message of `picture[row, column, colour]`, without a stamp."""
    height, width, colours = picture.shape
    return Image(height=height, width=width, encoding='rgb8', is_bigendian=0,
                 step=width * colours, data=array('B', picture.tobytes()))
