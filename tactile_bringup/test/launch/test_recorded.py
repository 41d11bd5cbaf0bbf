# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String
from tactile_bringup.launch.recorded import bag_of, recorded_topics
from tactile_driver.errors import BadArgument
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter


RAW = {'touchpad': ['image_raw'], 'areal_dual': ['left/image_raw', 'right/image_raw', 'image_raw'], 'psd_finger': ['voltages'],
       'marker_video': ['image_raw'], 'areal_single': ['image_raw/compressed'], 'camera': ['image_color']}


def write(path, **sensors):
    """A bag with the description, raw data and pictures of each sensor: name -> (type, source)."""
    with BagWriter(path) as bag:
        for name, (sensor_type, source) in sensors.items():
            kind, data = encode(String(data=f'sensor_type: {sensor_type}\nsource: {source}\n'))
            bag.write(f'/{name}/description', kind, 10**9, data)
            for topic in (*RAW[sensor_type], 'image_annotated'):
                kind, data = encode(CompressedImage() if topic.endswith('/compressed') else Image())
                bag.write(f'/{name}/{topic}', kind, 10**9, data)
    return str(path)


def test_one_bag_of_all_or_one_of_each(tmp_path):
    whole = write(tmp_path / 'whole', thumb=('touchpad', 'sim'), index=('touchpad', 'device'))
    write(tmp_path / 'each' / 'thumb', thumb=('touchpad', 'device'))
    assert bag_of(whole, 'index') == whole
    assert bag_of(str(tmp_path / 'each'), 'thumb') == str(tmp_path / 'each' / 'thumb')


def test_the_sensors_own_topics_are_chosen_and_whether_it_was_simulated(tmp_path):
    bag = write(tmp_path / 'bag', pad=('touchpad', 'sim'), palm=('areal_dual', 'device'), tip=('psd_finger', 'sim'))
    none = {}
    assert recorded_topics(bag, 'touchpad', 'touchpad', none) == ({'topic': '/pad/image_raw'}, True)
    assert recorded_topics(bag, 'areal_dual', 'x', none) == (
        {'topic': '/palm/left/image_raw', 'right_topic': '/palm/right/image_raw'}, False)
    assert recorded_topics(bag, 'psd_finger', 'psd_finger', none) == ({'topic': '/tip/voltages'}, True)


def test_a_recording_of_a_replay_knows_that_the_sensor_was_simulated(tmp_path):
    bag = write(tmp_path / 'bag', pad=('touchpad', 'bag\nrecorded: {source: sim}'), tip=('psd_finger', 'bag\nrecorded: {source: device}'))
    assert recorded_topics(bag, 'touchpad', 'touchpad', {}) == ({'topic': '/pad/image_raw'}, True)
    assert recorded_topics(bag, 'psd_finger', 'tip', {}) == ({'topic': '/tip/voltages'}, False)


@pytest.mark.parametrize('given', ['', '/sheet/image_raw', '/sheet/image_raw/compressed'])
def test_a_recording_of_compressed_images(tmp_path, given):
    bag = write(tmp_path / 'bag', sheet=('areal_single', 'sim'))
    assert recorded_topics(bag, 'areal_single', 'x', {'topic': given}) == ({'topic': given or '/sheet/image_raw'}, True)


def test_of_several_of_a_type_the_namespace_or_the_topic_chooses(tmp_path):
    bag = write(tmp_path / 'bag', thumb=('touchpad', 'sim'), index=('touchpad', 'device'))
    assert recorded_topics(bag, 'touchpad', 'index', {}) == ({'topic': '/index/image_raw'}, False)
    assert recorded_topics(bag, 'touchpad', 'touchpad', {'topic': '/thumb/image_raw'}) == ({'topic': '/thumb/image_raw'}, True)
    with pytest.raises(BadArgument, match='/index/.*/thumb/'):
        recorded_topics(bag, 'touchpad', 'touchpad', {})


def test_a_topic_of_another_name_is_left_to_the_driver(tmp_path):
    bag = write(tmp_path / 'bag', cam=('camera', 'device'))
    assert recorded_topics(bag, 'touchpad', 'touchpad', {}) == ({}, False)
    assert recorded_topics(bag, 'touchpad', 'touchpad', {'topic': '/cam/image_color'}) == ({'topic': '/cam/image_color'}, False)


def test_a_kind_of_sensor_that_has_no_launch_file_may_be_anything(tmp_path):
    bag = write(tmp_path / 'bag', gel=('marker_video', 'device'))
    assert recorded_topics(bag, 'touchpad', 'touchpad', {}) == ({'topic': '/gel/image_raw'}, False)


@pytest.mark.parametrize('wanted', ['areal_single', 'psd_finger'])
def test_a_recording_of_another_type_is_refused_by_name(tmp_path, wanted):
    bag = write(tmp_path / 'bag', pad=('touchpad', 'sim'))
    with pytest.raises(BadArgument, match=f'touchpad.*{wanted}.*touchpad.launch.py'):
        recorded_topics(bag, wanted, wanted, {})


def test_what_is_not_there_is_told(tmp_path):
    whole = write(tmp_path / 'whole', thumb=('touchpad', 'sim'))
    with pytest.raises(BadArgument, match='/palm.*/thumb/description'):
        bag_of(whole, 'palm')
    with pytest.raises(BadArgument, match='no such file'):
        bag_of(str(tmp_path / 'nowhere'), 'palm')
