# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two recorded views are read as the picture that they make."""

import numpy as np
import pytest
from dual_bags import DISTORTION, LATE, MATRIX, PARAMETERS, PERIOD, SENSOR, pair, write_pairs

from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.stitching.methods import make_stitcher
from tactile_perception.bags.stitched_bag import StitchedBag, bag_opener, stitching_in
from tactile_perception.core.calibration_file import CalibrationFile, write_calibration
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.press.stitching import fit_stitching


@pytest.fixture(scope='module')
def stitching():
    return fit_stitching(pair(), ((MATRIX, DISTORTION),) * 2, SENSOR).stitching


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Eight pairs of which the fourth lacks its right, the sixth its left view; each pair's grey level is its own."""
    left, right = pair()
    pairs = [[np.maximum(left, k), np.maximum(right, k)] for k in range(8)]
    pairs[3][1], pairs[5][0] = None, None
    return write_pairs(tmp_path_factory.mktemp('stitched') / 'bag', pairs)


def read(path, stitching, topics=None, method='plane'):
    with StitchedBag(path, stitching, method, 0.008) as reader:
        return reader.topics, [(raw.topic, raw.stamp_ns, decode(raw.data, raw.type_name)) for raw in reader.messages(topics)]


@pytest.mark.parametrize('method', ['plane', 'middle'])
def test_pairs_are_pictures_under_the_left_views_stamp(bag, stitching, method):
    topics, found = read(bag, stitching, method=method)
    assert '/pad/left/image_raw' not in topics and topics['/pad/image_raw'] == 'sensor_msgs/msg/Image'
    pictures = [(stamp, message) for topic, stamp, message in found if topic == '/pad/image_raw']
    assert [stamp for stamp, _ in pictures] == [10**9 + k * PERIOD for k in (0, 1, 2, 4, 6, 7)]
    stitcher, (left, right) = make_stitcher(method, stitching), pair()
    for k, (stamp, message) in zip((0, 1, 2, 4, 6, 7), pictures):
        assert (image_to_array(message) == stitcher.stitch(np.maximum(left, k), np.maximum(right, k))).all()
        assert message.header.frame_id == 'pad' and message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
    infos = [message for topic, _, message in found if topic == '/pad/camera_info']
    assert len(infos) == 6 and (infos[0].width, infos[0].height) == stitcher.size and not infos[0].k.any()
    times = [(stamp, m.time_ref.sec * 10**9 + m.time_ref.nanosec) for topic, stamp, m in found if topic == '/pad/right/time_reference']
    assert times == [(stamp, stamp + LATE) for stamp, _ in pictures]
    assert sum(topic == '/pad/ground_truth/contacts' for topic, _, _ in found) == 8


def test_views_without_a_pair_are_counted(bag, stitching):
    with StitchedBag(bag, stitching, 'plane', 0.008) as reader:
        assert [m.topic for m in reader.messages({'/pad/image_raw'})].count('/pad/image_raw') == 6
        assert reader.left_out.lines() == ["2 of /pad/left and right/image_raw: one camera's view without the other's"]


def test_views_that_are_too_far_apart_are_reported(bag, stitching):
    with StitchedBag(bag, stitching, 'plane', 0.003) as reader:
        assert not list(reader.messages({'/pad/image_raw'}))
        line, = reader.left_out.lines()
    assert line.startswith('14 of /pad/left and right/image_raw: ')


def test_only_what_is_asked_for_is_read(bag, stitching):
    _, found = read(bag, stitching, {'/pad/ground_truth/contacts'})
    assert {topic for topic, _, _ in found} == {'/pad/ground_truth/contacts'}


def test_a_bag_of_one_camera_is_read_as_it_is(recording_folder, tmp_path, stitching):
    from tactile_perception.tools.convert import command as convert_recording
    assert convert_recording.main([str(recording_folder), str(tmp_path / 'bag')]) == 0
    topics, found = read(tmp_path / 'bag', stitching)
    with BagReader(tmp_path / 'bag') as reader:
        assert topics == reader.topics and len(found) == len(list(reader.messages()))


def test_the_calibration_file_says_whether_and_how(tmp_path, bag, stitching):
    params = tmp_path / 'params.yaml'
    write_parameters(params, PARAMETERS)
    path = tmp_path / 'a.yaml'
    write_calibration(path, CalibrationFile('areal_dual', {}, {'stitching': stitching.to_dict()}, {}, {}))
    found = stitching_in(path, 'areal_dual')
    assert found.right.camera_centre == pytest.approx(stitching.right.camera_centre,
                                                      abs=1e-8) and found.origin == pytest.approx(stitching.origin, abs=1e-4)
    assert stitching_in('', 'areal_dual') is None
    assert bag_opener(params, None) is BagReader
    with bag_opener(params, found)(bag) as reader:
        assert '/pad/image_raw' in reader.topics
    write_calibration(path, CalibrationFile('areal_dual', {}, {'other': 1.0}, {}, {}))
    assert stitching_in(path, 'areal_dual') is None
