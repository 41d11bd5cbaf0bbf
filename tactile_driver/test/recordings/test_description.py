# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
import yaml
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tactile_driver.recordings.description import original, recorded_description
from tactile_driver.recordings.reader import BagReader

STORE = get_typestore(Stores.ROS2_JAZZY)
STRING = 'std_msgs/msg/String'
SIMULATED = {'sensor_type': 'touchpad', 'source': 'sim', 'scene': 'rest'}


@pytest.fixture
def described(tmp_path):
    """What a bag with these texts on topics says of the sensor with a raw topic."""
    def found(raw_topic, **texts):
        with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for name, text in texts.items():
                connection = writer.add_connection('/' + name.replace('__', '/'), STRING, typestore=STORE)
                writer.write(connection, 10**9, STORE.serialize_cdr(STORE.types[STRING](text), STRING))
        with BagReader(tmp_path / 'bag') as reader:
            return recorded_description(reader, raw_topic)
    return found


@pytest.mark.parametrize('raw_topic', ['/pad/image_raw', '/pad/left/image_raw'])
def test_the_description_beside_the_raw_topic_or_above_it(described, raw_topic):
    assert described(raw_topic, pad__description=yaml.safe_dump(SIMULATED), other__description='sensor_type: psd_finger') == SIMULATED


def test_a_recording_of_a_replay_keeps_the_description_of_the_sensor(described):
    replay = {'sensor_type': 'touchpad', 'source': 'bag', 'path': 'first', 'recorded': SIMULATED}
    assert described('/pad/image_raw', pad__description=yaml.safe_dump(replay)) == SIMULATED


def test_what_was_not_replayed_is_original():
    assert original(SIMULATED) == SIMULATED == original({'source': 'bag', 'recorded': SIMULATED})
    assert original({'recorded': 'by somebody else'}) == {'recorded': 'by somebody else'}


@pytest.mark.parametrize('text', ['a text', '[1, 2', ''])
def test_no_description_is_an_empty_one(described, text):
    assert described('/pad/image_raw', pad__description=text) == {}
