# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message

HEADER = header_of(12_000_000_345, 'pad')


@pytest.mark.parametrize(('shape', 'own', 'asked', 'encoding', 'step'), [
    ((4, 6, 3), 'bgr8', '', 'bgr8', 18), ((4, 6), 'mono8', '', 'mono8', 6), ((4, 6), 'mono8', 'bgr8', 'bgr8', 18),
    ((4, 6, 3), 'bgr8', 'mono8', 'mono8', 6)])
def test_images(shape, own, asked, encoding, step):
    pixels = np.arange(np.prod(shape), dtype=np.uint8).reshape(shape)
    message = image_to_message(Frame(pixels, 0, own), asked, HEADER)
    assert (message.width, message.height, message.encoding, message.step, len(message.data)) == (6, 4, encoding, step, 4 * step)
    assert message.header == HEADER
    if asked in ('', own):
        assert bytes(message.data) == pixels.tobytes()


def test_an_image_that_is_a_view_is_put_in_order():
    pixels = np.arange(96, dtype=np.uint8).reshape(4, 8, 3)[:, ::2]
    assert bytes(image_to_message(Frame(pixels, 0, 'bgr8'), '', HEADER).data) == np.ascontiguousarray(pixels).tobytes()
