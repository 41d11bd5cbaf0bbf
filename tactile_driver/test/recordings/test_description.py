# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
import yaml
from std_msgs.msg import String
from tactile_driver.errors import BadRecording
from tactile_driver.recordings.description import descriptions, original, recorded_description
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.writer import write_messages

SIMULATED = {'sensor_type': 'touchpad', 'source': 'sim', 'scene': 'rest'}


@pytest.fixture
def described(tmp_path):
    """What a bag with these texts on topics says of the sensor with a raw topic."""
    def found(raw_topic, **texts):
        write_messages(tmp_path / 'bag', '', ((10**9, '/' + name.replace('__', '/'), String(data=text)) for name, text in texts.items()))
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


@pytest.fixture
def bag(tmp_path):
    said = [('thumb/description', 'source: sim'), ('index/description', 'source: device\nserial: A1'), ('thumb/description', '[cut'),
            ('thumb/description', 'only words'), ('thumb/note', 'source: bag')]
    write_messages(tmp_path / 'bag', 'hand', ((k + 1, topic, String(data=text)) for k, (topic, text) in enumerate(said)))
    return tmp_path / 'bag'


def test_of_any_sensor_in_order_without_what_is_none(bag):
    assert list(descriptions(bag)) == [{'source': 'sim'}, {'source': 'device', 'serial': 'A1'}]


def test_of_one_sensor(bag):
    assert list(descriptions(bag, 'hand/index')) == [{'source': 'device', 'serial': 'A1'}]
    assert list(descriptions(bag, 'hand/palm')) == []


def test_a_recording_that_is_none_is_told(tmp_path):
    with pytest.raises(BadRecording):
        list(descriptions(tmp_path / 'nowhere'))
