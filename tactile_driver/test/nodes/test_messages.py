# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Images, truth and transforms as messages."""

import struct
import zlib
from array import array

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from tactile_driver.errors import BadFrame
from tactile_driver.nodes.messages.conversions import camera_transforms, header_of
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, region_message
from tactile_driver.nodes.messages.images import GREY, PICTURES, array_to_image, grey_to_array, image_to_array, message_type
from tactile_driver.simulation.truth import Touch, TruthFrame

COLOUR = np.random.default_rng(0).integers(0, 255, (4, 6, 3), dtype=np.uint8)
MONO = COLOUR[:, :, 0]
ALPHA = np.dstack([COLOUR, MONO])
WIDE = MONO.astype('<u2') * 257
EVEN = np.empty((4, 6, 3), np.uint8)
EVEN[:] = 40, 90, 200
#: Where a mosaic has red; its opposite corner has blue
RED = {'rggb': (0, 0), 'bggr': (1, 1), 'gbrg': (1, 0), 'grbg': (0, 1)}


def image(rows, encoding, big=False, **changes):
    """An Image of an array (height, ...), whose rows may be padded; changes: of its fields."""
    packed = np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), -1)
    fields = {'height': len(rows), 'width': 6, 'step': packed.shape[1], 'encoding': encoding, 'is_bigendian': int(big),
              'data': array('B', packed.tobytes()), **changes}
    return Image(**fields)


def compressed(pixels, kind='.png', says='', **changes):
    return CompressedImage(**{'format': says or kind[1:], 'data': array('B', cv2.imencode(kind, pixels)[1].tobytes()), **changes})


def packed_colour(order):
    """MONO without its colour, (4, 6, 2): U and V of grey are 128."""
    packed = np.full((4, 6, 2), 128, np.uint8)
    packed[:, :, order] = np.clip(MONO, 16, 235)
    return packed


def mosaic(pattern):
    """EVEN as a sensor with that pattern of filters sees it."""
    (y, x), seen = RED[pattern], np.full((4, 6), EVEN[0, 0, 1])
    seen[y::2, x::2], seen[1 - y::2, 1 - x::2] = EVEN[0, 0, 2], EVEN[0, 0, 0]
    return seen


CASES = {
    'bgr8': (COLOUR, COLOUR), '8UC3': (COLOUR, COLOUR), 'rgb8': (COLOUR[..., ::-1], COLOUR), 'bgra8': (ALPHA, COLOUR),
    'rgba8': (ALPHA[..., [2, 1, 0, 3]], COLOUR), 'mono8': (MONO, MONO), '8UC1': (MONO, MONO), 'mono16': (WIDE, MONO), '16UC1': (WIDE, MONO),
    **{f'bayer_{pattern}8': (mosaic(pattern), EVEN) for pattern in RED},
    **{f'bayer_{pattern}16': (mosaic(pattern).astype('<u2') * 257, EVEN) for pattern in RED},
    'yuv422': (packed_colour(1), None), 'yuv422_yuy2': (packed_colour(0), None),
}


@pytest.mark.parametrize('encoding', CASES)
@pytest.mark.parametrize('padding', [0, 5])
@pytest.mark.parametrize('big', [False, True])
def test_each_encoding_becomes_the_same_picture(encoding, padding, big):
    sent, expected = CASES[encoding]
    rows = np.ascontiguousarray(sent.astype('>u2') if big and sent.itemsize == 2 else sent).view(np.uint8).reshape(4, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    found = image_to_array(image(rows, encoding, big))
    assert found.dtype == np.uint8 and found.flags.c_contiguous
    if expected is None:  # luminance from 16 to 235 is brightness from 0 to 255
        assert np.abs(found - (np.clip(MONO, 16, 235)[..., None] - 16.0) * 255 / 219).max() < 2
    else:
        assert (found == expected).all()


@pytest.mark.parametrize('encoding', GREY)
@pytest.mark.parametrize('big', [False, True])
def test_grey_images_keep_their_bits(encoding, big):
    values = np.arange(24).reshape(4, 6) * (2800 if '16' in encoding else 10)
    found = grey_to_array(image(values.astype(('>u2' if big else '<u2') if '16' in encoding else np.uint8), encoding, big))
    assert found.dtype == (np.uint16 if '16' in encoding else np.uint8) and found.tolist() == values.tolist()


@pytest.mark.parametrize('changes, length', [
    ({'height': 5}, 72), ({'width': 7}, 72), ({'step': 17}, 68), ({'height': 0}, 0), ({'width': 0}, 72), ({'step': 0}, 0),
    ({'height': 2**32 - 1, 'width': 2**32 - 1, 'step': 2**32 - 1}, 72)])
def test_sizes_that_the_bytes_do_not_make(changes, length):
    with pytest.raises(BadFrame, match='here: .* do not make the'):
        image_to_array(image(COLOUR, 'bgr8', data=array('B', bytes(length)), **changes), 'here')


@pytest.mark.parametrize('encoding', ['', 'bayer_rggb', '32FC1', 'BGR8', 'jpeg', '8UC2', '\ufffd'])
def test_an_unknown_encoding_is_answered_with_those_that_are_known(encoding):
    with pytest.raises(BadFrame, match='is not supported; the driver has to publish one of ' + ', '.join(PICTURES)):
        image_to_array(image(COLOUR, encoding))


@pytest.mark.parametrize('encoding', ['yuv422', 'yuv422_yuy2'])
def test_two_pixels_of_packed_colour_belong_together(encoding):
    with pytest.raises(BadFrame, match='odd width 5'):
        image_to_array(image(np.zeros((4, 10), np.uint8), encoding, width=5))


@pytest.mark.parametrize('sent', [COLOUR, MONO, ALPHA, WIDE, cv2.merge([WIDE] * 3)], ids=['colour', 'grey', 'alpha', '16 bits', '48 bits'])
def test_a_png_is_what_it_was_made_of(sent):
    found = image_to_array(compressed(sent, says='a lie; jpeg compressed rgb8'))
    expected = sent // 257 if sent.dtype == np.uint16 else sent
    assert found.dtype == np.uint8 and (found == (expected[..., :3] if sent.ndim == 3 else expected)).all()


def test_a_jpeg_looks_like_what_it_was_made_of():
    smooth = cv2.GaussianBlur(np.random.default_rng(2).integers(0, 255, (48, 64, 3), dtype=np.uint8), (0, 0), 5)
    assert np.abs(image_to_array(compressed(smooth, '.jpg')).astype(int) - smooth).max() < 30
    padded = compressed(smooth, '.jpg')
    padded.data.extend(bytes(7))
    assert (image_to_array(padded) == image_to_array(compressed(smooth, '.jpg'))).all()
    assert image_to_array(compressed(smooth[..., 1], '.jpg')).shape == (48, 64)


def test_sixteen_bits_of_a_png_are_kept_for_taxels_and_colour_is_refused():
    assert (grey_to_array(compressed(WIDE)) == WIDE).all() and (grey_to_array(compressed(MONO)) == MONO).all()
    with pytest.raises(BadFrame, match='here: .* in colour'):
        grey_to_array(compressed(COLOUR), 'here')


@pytest.mark.parametrize('kind', ['.png', '.jpg'])
def test_a_compressed_image_that_is_cut_anywhere_is_refused(kind):
    data = compressed(COLOUR, kind).data
    for length in range(len(data)):
        with pytest.raises(BadFrame, match='here: '):
            image_to_array(CompressedImage(data=data[:length]), 'here')


@pytest.mark.parametrize('kind', ['.bmp', '.webp', '.tiff'])
def test_other_formats_are_refused_whatever_the_message_says(kind):
    with pytest.raises(BadFrame, match='neither JPEG nor PNG'):
        image_to_array(compressed(COLOUR, kind, says='png'))


def test_a_huge_image_in_few_bytes_is_refused_before_it_is_decoded():
    head = struct.pack('>IIBBBBB', 30000, 30000, 8, 0, 0, 0, 0)
    parts = [(b'IHDR', head), (b'IDAT', zlib.compress(bytes(1000))), (b'IEND', b'')]
    data = b'\x89PNG\r\n\x1a\n' + b''.join(struct.pack('>I', len(d)) + n + d + struct.pack('>I', zlib.crc32(n + d)) for n, d in parts)
    with pytest.raises(BadFrame, match='MAX_IMAGE_PIXELS'):
        image_to_array(CompressedImage(data=array('B', data)))
    jpeg = bytes(compressed(COLOUR, '.jpg').data)
    start = jpeg.index(b'\xff\xc0')
    jpeg = jpeg[:start + 5] + struct.pack('>HH', 65500, 65500) + jpeg[start + 9:]
    with pytest.raises(BadFrame, match='MAX_IMAGE_PIXELS'):
        image_to_array(CompressedImage(data=array('B', jpeg)))


@pytest.mark.parametrize('encoding', ['bgr8', 'mono8', 'mono16', 'rgb8', 'bgra8'])
def test_an_array_goes_through_a_message_and_back(encoding):
    sent = {'mono8': MONO, 'mono16': WIDE, 'bgra8': ALPHA}.get(encoding, COLOUR)[:, ::-1]
    header = Header(frame_id='pad')
    message = array_to_image(sent, encoding, header)
    assert (message.height, message.width, message.encoding, message.header.frame_id) == (4, 6, encoding, 'pad')
    assert (message.step, bytes(message.data)) == (sent[:1].nbytes, np.ascontiguousarray(sent).tobytes())


@pytest.mark.parametrize('topic, kind', [('/pad/image_raw', Image), ('/pad/image_raw/compressed', CompressedImage),
                                         ('compressed', Image), ('/compressed', CompressedImage)])
def test_the_name_of_a_topic_tells_whether_it_is_compressed(topic, kind):
    assert message_type(Image, topic) is kind
    assert message_type(Header, topic) is Header


HEADER_GROUND = header_of(1_000, 'pad')


def touch(x):
    return Touch(np.array([x, 0.0, 0.01]), np.array([0.0, 0.0, 1.0]), 0.002, 1.5)


def truth(**known):
    return TruthFrame(np.array([0, 5]), np.zeros((2, 2)), np.zeros((2, 3)), np.array([0, 2], np.uint8), **known)


def test_a_touch_keeps_its_number_while_it_lasts():
    numbers = TouchNumbers()
    assert numbers.assign([touch(0.0), touch(0.01)]) == [0, 1]
    assert numbers.assign([touch(0.011), touch(0.001)]) == [1, 0]
    assert numbers.assign([touch(0.012)]) == [1]
    assert numbers.assign([]) == []
    assert numbers.assign([touch(0.012)]) == [2]


def test_motion():
    # A quarter turn about x and a displacement of 3 mm along y.
    message = region_message(truth(motion=np.array([0, 3e-3, 0, np.pi / 2, 0, 0])), 0.02, HEADER_GROUND)
    turn = message.motion.rotation
    assert message.motion.translation.y == 3e-3 and message.motion_interval == 0.02
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0.5 ** 0.5, 0, 0, 0.5 ** 0.5))
    assert region_message(truth(motion=np.zeros(6)), 0.02, HEADER_GROUND).motion.rotation.w == 1.0


def turned(quaternion, point):
    """The point (3,) turned by the quaternion x, y, z, w: v + 2 w (q x v) + 2 q x (q x v)."""
    axis, w = np.array(quaternion[:3]), quaternion[3]
    return point + 2 * w * np.cross(axis, point) + 2 * np.cross(axis, np.cross(axis, point))


@pytest.mark.parametrize('rotation', [(0.0, 0.0, 0.0), (0.4, -0.2, 0.9), (np.pi, 0.0, 0.0)])
def test_what_the_camera_sees_is_brought_back_to_where_it_is_in_the_sensor_frame(rotation):
    translation, point = np.array([0.01, -0.02, 0.05]), np.array([0.003, 0.004, -0.001])
    seen = cv2.Rodrigues(np.array(rotation))[0] @ point + translation
    reported, = camera_transforms('pad', {'left': (rotation, translation)})
    at, turn = reported.transform.translation, reported.transform.rotation
    quaternion = turn.x, turn.y, turn.z, turn.w
    assert (reported.header.frame_id, reported.child_frame_id) == ('pad', 'pad_left_camera_optical')
    np.testing.assert_allclose(turned(quaternion, seen) + [at.x, at.y, at.z], point, atol=1e-15)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)
