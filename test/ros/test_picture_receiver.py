# SPDX-License-Identifier: Apache-2.0
"""Pictures of the environment on the page: received while somebody looks, and shown as JPEG."""

from base64 import b64decode
from io import BytesIO

import numpy as np
from PIL import Image as JpegImage
import pytest
from sensor_msgs.msg import Image
from short_training import spin_until

from comply_ros.dashboard import picture_receiver
from comply_ros.dashboard.picture_receiver import picture_url, PictureReceiver
from comply_ros.nodes.picture_publisher import image_message
from comply_ros.nodes.topics import IMAGE, IMAGE_QOS

BLUE = np.full((30, 40, 3), (0, 0, 255), dtype=np.uint8)


def pixels_of(url):
    """Return the pixels of a picture in an address."""
    head, _, content = url.partition(',')
    assert head == 'data:image/jpeg;base64'
    return np.asarray(JpegImage.open(BytesIO(b64decode(content))))


def test_a_picture_is_shown_in_its_colours():
    pixels = pixels_of(picture_url(image_message(BLUE)))
    assert pixels.shape == (30, 40, 3)
    assert np.abs(pixels.astype(int) - BLUE).max() < 4


def test_bytes_behind_the_pixels_of_a_row_are_left_out():
    msg = image_message(BLUE)
    msg.step += 2
    msg.data = np.pad(BLUE.reshape(30, 120), ((0, 0), (0, 2)), constant_values=255).tobytes()
    assert np.abs(pixels_of(picture_url(msg)).astype(int) - BLUE).max() < 4


def test_a_large_picture_is_shown_smaller():
    large = np.zeros((900, 2000, 3), dtype=np.uint8)
    assert pixels_of(picture_url(image_message(large))).shape == (300, 667, 3)  # every third


@pytest.mark.parametrize('fields, message', [
    ({'encoding': 'bgr8'}, "a picture must be encoded as rgb8, got 'bgr8'"),
    ({'width': 41}, 'a picture of 41 x 30 pixels must have rows of at least 123 bytes, got rows '
     'of 120 and 3600 bytes'),
    ({'height': 31}, 'a picture of 40 x 31 pixels must have rows of at least 120 bytes, got rows '
     'of 120 and 3600 bytes'),
    ({'height': 0}, 'a picture of 40 x 0 pixels must'), ({'width': 0}, 'a picture of 0 x 30')])
def test_a_message_that_is_no_picture_is_rejected(fields, message):
    msg = image_message(BLUE)
    for name, value in fields.items():
        setattr(msg, name, value)
    with pytest.raises(ValueError) as error:
        picture_url(msg)
    assert str(error.value).startswith(message)


def test_pictures_are_received_while_somebody_wants_them(domain, node, monkeypatch):
    receiver = PictureReceiver(node)
    receiver.tick()
    assert not receiver.is_published
    publisher = node.create_publisher(Image, IMAGE, IMAGE_QOS)
    spin_until(node, lambda: receiver.tick() or receiver.is_published, 'publisher')
    assert publisher.get_subscription_count() == 0
    receiver.want()

    def is_received():
        receiver.tick()
        publisher.publish(image_message(BLUE))
        return receiver.url
    spin_until(node, is_received, 'picture')
    monkeypatch.setattr(picture_receiver, 'WANTED_FOR', 0.0)
    receiver.tick()
    assert receiver.url == ''
    spin_until(node, lambda: publisher.get_subscription_count() == 0, 'end of the subscription')
