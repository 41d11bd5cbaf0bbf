# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unusable messages through the stages that nodes and process_bag share raise a named error, and the next good one is processed."""
import copy

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_perception.bags.chain import Chain  # noqa: E402
from tactile_perception.dots.stage import DotStage  # noqa: E402
from tactile_perception.errors import BadArgument, BadFrame, TactileError  # noqa: E402
from tactile_perception.nodes.messages.conversions import camera_info_message  # noqa: E402
from tactile_perception.touchpad.stage import ContactRegionStage  # noqa: E402

pytestmark = pytest.mark.ros


class Feed:
    """Images and camera_info as messages into both stages; stamps go on by themselves."""

    def __init__(self, pad, **changes):
        values = pad.values(**changes)
        self.pad, self.contact, self.count = pad, ContactRegionStage(values), 0
        self.chain = Chain([DotStage(values), self.contact])

    def header(self):
        self.count += 1
        return header_of(self.count * 100_000_000 + 10**9, 'pad')

    def info(self, **changes):
        message = camera_info_message(self.pad.info, self.header())
        for name, value in changes.items():
            setattr(message, name, value)
        self.chain.take('camera_info', message)

    def image(self, image, spoil=None):
        header = self.header()
        message = image_to_message(Frame(image, self.count * 100_000_000 + 10**9, 'bgr8'), '', header)
        if spoil:
            spoil(message)
        found = {}
        for _stage, topic, result in self.chain.process(message):
            if isinstance(result, TactileError):
                raise result
            found[topic] = result
        return found


@pytest.fixture(scope='module')
def running(pad):
    feed = Feed(pad)
    feed.info()
    for image in pad.rest[:2]:
        feed.image(image)
    return feed


def cut(message):
    message.data = message.data[:1000]


def renamed(message):
    message.encoding = 'nv12'


def no_encoding(message):
    message.encoding = ''


def too_wide(message):
    message.width = 10 * message.width


def no_rows(message):
    message.height, message.data = 0, []


def wrong_step(message):
    message.step //= 2
    message.height *= 2


def floats(message):
    message.encoding = '32FC1'


@pytest.mark.parametrize('spoil, message', [
    (cut, 'frame is cut'), (renamed, 'not supported'), (no_encoding, 'not supported'), (floats, 'not supported'),
    (too_wide, 'cannot be decoded|frame is cut'), (no_rows, 'frame is cut'),
    (wrong_step, 'cannot be decoded|changed its shape|frame is cut')])
def test_a_bad_image_message_is_refused_and_the_next_good_one_is_done(pad, running, spoil, message):
    with pytest.raises(BadFrame, match=message):
        running.image(pad.rest[2], spoil)
    results = running.image(pad.rest[3])
    assert len(results['dots'].id) > 515 and results['contact_region'].area == 0


def test_without_camera_info_nothing_is_placed(pad):
    feed = Feed(pad)
    with pytest.raises(BadFrame, match='no camera_info'):
        feed.image(pad.rest[0])
    feed.info()
    assert len(feed.image(pad.rest[0])['dots'].x) > 515


def test_a_camera_info_of_zeros_gives_dots_but_no_places_and_no_contact(pad):
    feed = Feed(pad)
    feed.info(k=np.zeros(9), d=[])
    found = feed.chain.process(image_to_message(Frame(pad.rest[0], 10**9, 'bgr8'), '', header_of(10**9, 'pad')))
    _stage, topic, dots = next(found)
    assert topic == 'dots' and len(dots.id) > 515 and not len(dots.x)
    _stage, topic, error = next(found)
    assert topic == 'dots' and isinstance(error, BadFrame) and 'camera' in str(error)
    feed.info()
    assert feed.image(pad.rest[1])['contact_region'].area == 0


@pytest.mark.parametrize('name, changes', [
    ('focal length NaN', {'k': np.array([np.nan, 0, 320, 0, 688, 240, 0, 0, 1])}),
    ('focal length zero', {'k': np.array([0.0, 0, 320, 0, 688, 240, 0, 0, 1])}),
    ('distortion NaN', {'d': [np.nan, 0.0, 0.0, 0.0, 0.0]}),
    ('another model', {'distortion_model': 'equidistant'}), ('too many coefficients', {'d': [0.0] * 8})])
def test_a_camera_info_that_cannot_be_used_is_refused_and_the_old_one_stays(pad, running, name, changes):
    with pytest.raises(TactileError, match='camera'):
        running.info(**changes)
    assert running.image(pad.rest[3])['contact_region'].area == 0


def test_a_changed_camera_info_begins_anew(pad):
    """Another focal length: the reference is taken anew, so that nothing is measured against rest places of the other camera."""
    feed = Feed(pad)
    feed.info()
    feed.image(pad.rest[0])
    moved = copy.copy(pad.info)
    matrix = np.array(moved['K'], float)
    matrix[0, 2] += 1.0
    feed.info(k=matrix.ravel())
    dots = feed.image(pad.rest[1])['dots']
    assert max(np.abs(dots.du)) == 0


def test_an_image_of_another_size_than_camera_info_is_refused(pad, small_pad):
    feed = Feed(pad)
    feed.info()
    with pytest.raises(BadFrame, match='320 x 240.*640 x 480'):
        feed.image(small_pad.rest[0])
    assert len(feed.image(pad.rest[0])['dots'].x) > 515


def test_a_camera_that_changes_its_size_goes_on_with_its_new_camera_info(pad, small_pad):
    feed = Feed(pad)
    feed.info()
    feed.image(pad.rest[0])
    feed.pad = small_pad
    feed.info()
    assert len(feed.image(small_pad.rest[0])['dots'].x) > 515
    assert feed.image(small_pad.rest[1])['contact_region'].area == 0


def test_dots_that_cannot_be_used_are_refused(pad, running):
    contact = running.contact
    good = running.image(pad.rest[3])['dots']

    def refused(match, **changes):
        bad = copy.deepcopy(good)
        for name, value in changes.items():
            setattr(bad, name, value)
        bad.header = running.header()
        with pytest.raises(BadFrame, match=match):
            contact.on_dots(bad)

    refused('entries', u=good.u[:3])
    refused('entries', x=good.x[:3])
    refused('grid', rows=5)
    refused('surface cap', x=[], y=[], z=[])
    assert running.image(pad.rest[4])['contact_region'].area == 0


def test_dots_with_places_that_are_no_numbers_are_left_out(pad, running):
    good = running.image(pad.rest[3])['dots']
    bad = copy.deepcopy(good)
    bad.header = running.header()
    for name in 'xyz':
        values = np.array(getattr(bad, name))
        values[::10] = np.nan
        setattr(bad, name, values.tolist())
    results = running.contact.on_dots(bad)
    assert len(results['contact_region'].dot_id) == len(good.id) - len(good.id[::10]) and results['contact_region'].area == 0


def test_parameters_that_do_not_fit_together_are_refused(pad):
    with pytest.raises(BadArgument, match='rows and columns'):
        Feed(pad, rows=2, columns=2)
    with pytest.raises(BadArgument, match='camera.rotation'):
        Feed(pad, camera__rotation=[0.0, 0.0])
