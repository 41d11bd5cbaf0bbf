# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bytes of images in every encoding and byte order; what makes no image is refused by name."""
from array import array

import cv2
import numpy as np
import pytest
from tactile_driver.errors import BadFrame
from tactile_driver.pixels import PICTURES, picture_of, pixels_of

COLOUR = np.random.default_rng(0).integers(0, 255, (4, 6, 3), dtype=np.uint8)
GREY = COLOUR[:, :, 0]
ALPHA = np.dstack([COLOUR, GREY])


def yuv(order):
    """COLOUR without its colour, (4, 12) bytes: U and V of grey are 128."""
    packed = np.full((4, 6, 2), 128, np.uint8)
    packed[:, :, order] = np.clip(GREY, 16, 235)
    return packed


CASES = {
    'bgr8': (COLOUR, COLOUR), 'rgb8': (COLOUR[..., ::-1], COLOUR), 'bgra8': (ALPHA, COLOUR), 'rgba8': (ALPHA[..., [2, 1, 0, 3]], COLOUR),
    'mono8': (GREY, GREY), 'mono16': (GREY.astype('<u2') * 257, GREY),
}


@pytest.mark.parametrize('encoding', CASES)
@pytest.mark.parametrize('padding', [0, 5])
def test_each_encoding_becomes_the_same_picture(encoding, padding):
    sent, expected = CASES[encoding]
    rows = np.ascontiguousarray(sent).view(np.uint8).reshape(4, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    found = picture_of(array('B', rows.tobytes()), (4, 6, rows.shape[1]), encoding, False, 'here')
    assert found.dtype == np.uint8 and found.flags.c_contiguous and (found == expected).all()


@pytest.mark.parametrize('encoding, order', [('yuv422', 1), ('yuv422_yuy2', 0)])
def test_packed_colour_has_its_brightness_where_it_belongs(encoding, order):
    found = picture_of(yuv(order).ravel(), (4, 6, 12), encoding, False, 'here')
    assert np.abs(found - (np.clip(GREY, 16, 235)[..., None] - 16.0) * 255 / 219).max() < 2


def test_both_byte_orders_tell_the_same_values():
    values = np.array([[258, 3], [65535, 0]], np.uint16)
    for order, big in (('<u2', False), ('>u2', True)):
        found = pixels_of(array('B', values.astype(order).tobytes()), (2, 2, 4), 'mono16', big, 'here')
        assert found.dtype == np.uint16 and found.tolist() == values.tolist()
    assert picture_of(array('B', values.astype('>u2').tobytes()), (2, 2, 4), 'mono16', True, 'here').tolist() == [[1, 0], [255, 0]]


def test_eight_bits_have_no_byte_order():
    assert (picture_of(COLOUR.ravel(), (4, 6, 18), 'bgr8', True, 'here') == COLOUR).all()


@pytest.mark.parametrize('size, length', [((5, 6, 18), 72), ((4, 7, 18), 72), ((4, 6, 17), 68), ((0, 6, 18), 0), ((4, 0, 18), 72),
                                          ((4, 6, 0), 0), ((2**32 - 1, 2**32 - 1, 2**32 - 1), 72)])
def test_sizes_that_the_bytes_do_not_make(size, length):
    with pytest.raises(BadFrame, match='here: .* do not make the'):
        picture_of(np.zeros(length, np.uint8), size, 'bgr8', False, 'here')


@pytest.mark.parametrize('encoding', ['', 'bayer_rggb8', '32FC1', 'BGR8', 'jpeg', '\ufffd'])
def test_an_unknown_encoding_is_answered_with_those_that_are_known(encoding):
    with pytest.raises(BadFrame, match='is not supported; the driver has to publish one of ' + ', '.join(PICTURES)):
        picture_of(np.zeros(72, np.uint8), (4, 6, 18), encoding, False, 'here')


def test_two_pixels_of_packed_colour_belong_together():
    with pytest.raises(BadFrame, match='odd width 5'):
        picture_of(np.zeros(40, np.uint8), (4, 5, 10), 'yuv422', False, 'here')


def test_the_colours_are_those_of_opencv():
    packed = np.random.default_rng(1).integers(0, 255, (4, 6, 2), dtype=np.uint8)
    assert (picture_of(packed.ravel(), (4, 6, 12), 'yuv422_yuy2', False, 'here') == cv2.cvtColor(packed, cv2.COLOR_YUV2BGR_YUYV)).all()
