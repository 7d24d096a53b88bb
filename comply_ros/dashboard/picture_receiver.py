# SPDX-License-Identifier: Apache-2.0
"""Receives pictures of the environment while a visitor of the page sees them."""

from base64 import b64encode
from io import BytesIO
from math import ceil
import time

import numpy as np
from PIL import Image as JpegImage
from rclpy.node import Node
from sensor_msgs.msg import Image

from comply_ros.nodes.topics import IMAGE, IMAGE_QOS

LARGEST_SIDE = 800  # pixels on the page; of a larger picture, every second or third is shown
WANTED_FOR = 3.0  # seconds after the last visitor who wanted pictures


class PictureReceiver:
    """
    Subscribes while pictures are wanted, so that none is drawn for a page that nobody looks at.

    Attributes
    ----------
    is_published: whether a node publishes pictures.
    url: the last picture, as an address with the picture in it; '' while there is none.

    """

    def __init__(self, node: Node) -> None:
        self._node, self._subscription = node, None
        self._last_wanted = float('-inf')  # by the steady clock
        self.is_published, self.url = False, ''

    def want(self) -> None:
        """Let pictures be received for a while; may be called from any thread."""
        self._last_wanted = time.monotonic()

    def tick(self) -> None:
        """Subscribe, or end that; to be called once a second."""
        self.is_published = self._node.count_publishers(
            self._node.resolve_topic_name(IMAGE)) > 0
        is_wanted = self.is_published and time.monotonic() - self._last_wanted < WANTED_FOR
        if is_wanted and self._subscription is None:
            self._subscription = self._node.create_subscription(
                Image, IMAGE, self._receive, IMAGE_QOS)
        elif not is_wanted and self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription, self.url = None, ''

    def _receive(self, msg: Image) -> None:
        try:
            self.url = picture_url(msg)
        except ValueError as error:
            self._node.get_logger().warning(f'rejected: {error}', once=True)


def picture_url(msg: Image) -> str:
    """
    Return an address that has a picture in it, as a JPEG.

    Raises
    ------
    ValueError: for a picture of another encoding than `rgb8`, or that lacks bytes.

    """
    if msg.encoding != 'rgb8':
        raise ValueError(f'a picture must be encoded as rgb8, got {msg.encoding!r:.80}')
    row = 3 * msg.width
    if not 0 < row <= msg.step or not 0 < msg.height * msg.step == len(msg.data):
        raise ValueError(f'a picture of {msg.width} x {msg.height} pixels must have rows of at '
                         f'least {row} bytes, got rows of {msg.step} and {len(msg.data)} bytes')
    pixels = np.frombuffer(msg.data, dtype=np.uint8).reshape(msg.height, msg.step)[:, :row]
    stride = ceil(max(msg.height, msg.width) / LARGEST_SIDE)
    shown = pixels.reshape(msg.height, msg.width, 3)[::stride, ::stride]
    file = BytesIO()
    JpegImage.fromarray(np.ascontiguousarray(shown)).save(file, 'JPEG', quality=85)
    return 'data:image/jpeg;base64,' + b64encode(file.getvalue()).decode()
