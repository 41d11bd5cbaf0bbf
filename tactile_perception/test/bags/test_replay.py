# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording replayed frame by frame, and judged."""
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import Header
from taxel_bags import write_taxels
from tf2_msgs.msg import TFMessage

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import BagWriter
from tactile_msgs.msg import Contact, Contacts, Slip
from tactile_perception.bags.replay import Replay
from tactile_perception.bags.stamped import TRUTH, find_prefix, pairs_of
from tactile_perception.core.errors import BadArgument, BadCalibration, BadRecording
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.tools.judged_bag import JudgedBag


def of(messages, topic):
    """The messages of a topic."""
    return [message for one in messages for message in one if message.topic == topic]


def test_estimates_come_frame_by_frame(tmp_path):
    bag = write_taxels(tmp_path / 'bag', 5, change=lambda k, m: encode(m)[1] if k != 2 else b'x')
    replay = Replay(bag, tmp_path / 'bag.yaml')
    each = [f'/pad/{name}' for name in ('contact_region', 'contacts', 'slip', 'wrench', 'points')]
    assert [[message.topic for message in messages] for messages in replay] == [each, each, [], each, each]
    assert replay.prefix == '/pad/' and replay.done == 5 and len(replay.stages['all']) == 4
    line, = replay.left_out.lines()
    assert line.startswith('1 of image_raw: ') and line.endswith('(first at 1.040 s)')


def test_transforms_tell_of_the_grasped_object_and_those_that_stay_are_written_again(tmp_path):
    link = TransformStamped(child_frame_id='pad')
    link.header.frame_id = 'world'
    link.transform.rotation.z, link.transform.rotation.w = math.sqrt(0.5), math.sqrt(0.5)
    object_known = {'object.weight': 2.0, 'object.gravity': [0.0, -1.0, 0.0], 'object.gravity_frame': 'world'}
    bag = write_taxels(tmp_path / 'bag', 20, first=[('/tf_static', TFMessage(transforms=[link]))], **object_known)
    messages = list(Replay(bag, tmp_path / 'bag.yaml'))
    assert {message.topic for one in messages for message in one} == {
        '/tf_static', *(f'/pad/{name}' for name in ('contact_region', 'contacts', 'slip', 'wrench', 'points'))}
    last = of(messages, '/pad/wrench')[-1]
    force = decode(last.data, last.type_name).wrench.force
    assert [force.x, force.y] == pytest.approx([-1.0, 0.0], abs=1e-12)


def test_images_before_the_first_camera_info_are_done_too(tmp_path, pressed_bag):
    with BagReader(pressed_bag) as reader, BagWriter(tmp_path / 'bag') as writer:
        images = [m for m in reader.messages({'/touchpad/image_raw'})][:2]
        info = next(reader.messages({'/touchpad/camera_info'}))
        for message in images:
            writer.write(message.topic, message.type_name, message.stamp_ns, message.data)
        writer.write(info.topic, info.type_name, images[1].stamp_ns + 1, info.data)
    replay = Replay(tmp_path / 'bag', Path(f'{pressed_bag}.yaml'))
    assert len(of(replay, '/touchpad/contacts')) == 2 and not replay.left_out.total


def test_a_recording_of_dots_alone_gives_contacts(tmp_path, pressed_bag):
    params = Path(f'{pressed_bag}.yaml')
    whole = [message for messages in Replay(pressed_bag, params) for message in messages]
    with BagWriter(tmp_path / 'bag') as writer:
        for one in whole:
            if one.topic in ('/touchpad/dots', '/touchpad/camera_info'):
                writer.write(one.topic, one.type_name, one.stamp_ns, one.data)
    areas = [[decode(one.data, one.type_name).area for one in messages if one.topic == '/touchpad/contact_region']
             for messages in (whole, [m for some in Replay(tmp_path / 'bag', params) for m in some])]
    assert areas[1] == pytest.approx(areas[0], rel=1e-3, abs=1e-9) and max(areas[0]) > 1e-5


def test_a_sensor_of_no_known_type_has_dots(tmp_path):
    own = {'sensor_type': 'dots', 'numbering': 'tracks'}
    write_parameters(tmp_path / 'my_skin.yaml', own)
    image = np.full((120, 160), 170, np.uint8)
    for k in range(12):
        cv2.circle(image, (20 + 38 * (k % 4), 20 + 38 * (k // 4)), 5, 40, -1, cv2.LINE_AA)
    image = cv2.GaussianBlur(image, (0, 0), 1.0)
    with BagWriter(tmp_path / 'bag') as writer:
        for k in range(1, 4):
            message = image_to_message(Frame(image, 10**8 * k, 'mono8'), '', header_of(10**8 * k, 'skin_camera_optical'))
            kind, data = encode(message)
            writer.write('/skin/image_raw', kind, 10**8 * k, data)
    dots = of(Replay(tmp_path / 'bag', tmp_path / 'my_skin.yaml'), '/skin/dots')
    assert [len(decode(one.data, one.type_name).id) for one in dots] == [12] * 3


def test_each_image_comes_with_what_is_known_of_it(pressed_bag):
    infos = []
    found = list(pairs_of(pressed_bag, '', ('image_raw', TRUTH), infos.append))
    assert len(found) == len(infos) == 14
    for name, pair in found:
        assert pair['image_raw'].header.stamp == pair[TRUTH].header.stamp
        assert name.startswith('disc at ')
    assert [len(pair[TRUTH].contacts) for _, pair in found][0] == 0


def test_the_sensor_is_found_or_has_to_be_named():
    image = 'sensor_msgs/msg/Image'
    assert find_prefix({'/a/image_raw': image, '/a/dots': 'x'}, '') == '/a/'
    assert find_prefix({'/a/image_raw': image, '/b/image_raw': image}, 'b') == '/b/'
    assert find_prefix({'/a/left/image_raw': image, '/a/right/image_raw': image}, '', 'left/image_raw') == '/a/'
    assert find_prefix({f'/a/{view}image_raw': image for view in ('', 'left/', 'right/')}, '') == '/a/', 'one sensor and its two views'
    with pytest.raises(BadRecording, match='--namespace'):
        find_prefix({'/a/image_raw': image, '/b/image_raw': image}, '')


def test_a_bag_without_truth_is_refused(pressed_bag, tmp_path):
    with BagReader(pressed_bag) as reader, BagWriter(tmp_path / 'bare') as writer:
        for raw in reader.messages({'/touchpad/image_raw'}):
            writer.write(raw.topic, raw.type_name, raw.stamp_ns, raw.data)
    with pytest.raises(BadCalibration, match='tool'):
        list(pairs_of(tmp_path / 'bare', '', ('image_raw', TRUTH), lambda _info: None))


MS = 10**6


def write(path, messages):
    """A bag of (stamp ns, received ns, topic, message)."""
    with BagWriter(path) as writer:
        for stamp, received, topic, message in messages:
            message.header = header_of(stamp, 'pad')
            type_name, data = encode(message)
            writer.write(topic, type_name, received, data)
    return path


def contacts(depth):
    return Contacts(header=Header(), contacts=[Contact(depth=depth)])


def image(stamp):
    return image_to_message(Frame(np.zeros((2, 2), np.uint8), stamp, 'mono8'), '', Header())


def live(path):
    rows = []
    for k in range(1, 6):
        stamp = k * 33 * MS
        rows += [(stamp, stamp + MS, '/pad/image_raw', image(stamp)), (stamp, stamp + 2 * MS, '/pad/ground_truth/contacts', contacts(1.0))]
        if k != 3:
            rows.append((stamp, stamp + (20 + k) * MS, '/pad/contacts', contacts(1.0 + k)))
    return write(path, [*rows, (7, 300 * MS, '/pad/contacts', contacts(0.0))])


def test_each_instant_has_both(tmp_path):
    bag = JudgedBag(live(tmp_path / 'live'))
    found = [(stamp, reported.contacts[0].depth - 1, true.contacts[0].depth) for stamp, reported, true in bag.instants()]
    assert found == [(pytest.approx(k * 0.033), k, 1.0) for k in (1, 2, 4, 5)]
    assert bag.unmatched == {'without an estimate': 1, 'without truth': 1}
    assert bag.times()['latency_ms']['contacts']['median'] == pytest.approx(24)


def test_long_recordings_are_judged_in_parts(tmp_path):
    second = 1000 * MS
    rows = [row for k in range(40) for row in ((k * second, k * second, '/pad/ground_truth/contacts', contacts(1.0)),
                                               (k * second, (k + 5) * second, '/pad/contacts', contacts(float(k))))]
    bag, depths = JudgedBag(write(tmp_path / 'bag', sorted(rows, key=lambda row: row[1]))), []
    for _, reported, _ in bag.instants():
        depths.append(reported.contacts[0].depth)
    assert depths == list(range(40)) and not +bag.unmatched


def test_latencies_are_only_those_of_a_live_recording(tmp_path):
    rows = [(k * MS, k * MS + 5 * MS, topic, contacts(1.0)) for k in range(3) for topic in ('/pad/contacts', '/pad/ground_truth/contacts')]
    offline = JudgedBag(write(tmp_path / 'offline', rows))
    assert len(list(offline.instants())) == 3 and offline.times()['latency_ms'] == {}
    old = [(stamp, received + 10**13, topic, message) for stamp, received, topic, message in rows]
    played = JudgedBag(write(tmp_path / 'played', [*old, (1, 10**13, '/pad/image_raw', image(1))]))
    assert len(list(played.instants())) == 3 and played.times()['latency_ms'] == {}, 'the stamps are of another clock'


def test_a_message_that_cannot_be_meant_is_counted(tmp_path):
    rows = [(k, k, '/pad/slip', Slip(state=4 * (k == 1))) for k in range(3)] + [(k, k, '/pad/ground_truth/slip', Slip()) for k in range(3)]
    bag = JudgedBag(write(tmp_path / 'bag', rows))
    assert [reported.slip is None for _, reported, _ in bag.instants()] == [False, True, False]
    assert bag.left_out.lines() == ['1 of slip: slip: state 4 is not one of 0 to 2 (first at 0.000 s)']


def test_a_damaged_message_is_counted_and_the_rest_judged(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        for k in range(3):
            for topic in ('/pad/contacts', '/pad/ground_truth/contacts'):
                message = contacts(1.0)
                message.header = header_of(k, 'pad')
                type_name, data = encode(message)
                writer.write(topic, type_name, k, data[:9] if (k, topic) == (1, '/pad/contacts') else data)
    bag = JudgedBag(tmp_path / 'bag')
    assert len(list(bag.instants())) == 2 and +bag.unmatched == {'without an estimate': 1}
    line, = bag.left_out.lines()
    assert line.startswith('1 of contacts: 9 bytes')


@pytest.mark.full
def test_computed_anew_each_stage_is_timed(pressed_bag):
    bag = JudgedBag(pressed_bag, params=pressed_bag.with_name('disc.yaml'))
    found = list(bag.instants())
    assert len(found) == 14 and not +bag.unmatched and all(reported.contacts is not None for _, reported, _ in found)
    times = bag.times()
    assert set(times['stages_ms']) == {'decoding', 'estimating', 'all'} and times['latency_ms'] == {}
    stages = {name: stage['median'] for name, stage in times['stages_ms'].items()}
    assert 0 < stages['decoding'] < stages['estimating'] < stages['all'] < 1000
    assert times['stages_ms']['all']['count'] == 14 and 50 < times['memory_mb'] < 4000


@pytest.mark.parametrize('topics, namespace, message', [
    (['/pad/contacts'], '', 'no ground truth'),
    (['/pad/ground_truth/contacts', '/pad/image_raw'], '', 'process_bag'),
    (['/a/contacts', '/a/ground_truth/contacts', '/b/ground_truth/contacts'], '', '2 topics .*/a/.*, /b/'),
    (['/a/contacts', '/a/ground_truth/contacts'], 'c', 'no /c/.*/a/')])
def test_what_cannot_be_judged_is_said(tmp_path, topics, namespace, message):
    made = {topic: image(0) if topic.endswith('raw') else contacts(0.0) for topic in topics}
    path = write(tmp_path / 'bag', [(1, 1, topic, m) for topic, m in made.items()])
    with pytest.raises(BadRecording, match=message):
        JudgedBag(path, namespace)


def test_a_parameter_file_that_is_not_there_is_said(pressed_bag, tmp_path):
    with pytest.raises(BadArgument, match='none.yaml'):
        JudgedBag(pressed_bag, params=tmp_path / 'none.yaml')


def sampled(path, truth, stamps):
    """A bag with true contacts (stamp ns -> list of (id, x)), and an estimate at each of the stamps."""
    rows = [(stamp, stamp, '/pad/contacts', contacts(0.0)) for stamp in stamps]
    for stamp, known in truth.items():
        message = Contacts(header=Header(), contacts=[Contact(id=number, force=x, depth=0.1 * x) for number, x in known])
        for contact, (_, x) in zip(message.contacts, known):
            contact.position.x, contact.normal.y, contact.normal.z = x, x, 1.0
        rows.append((stamp, stamp, '/pad/ground_truth/contacts', message))
    return JudgedBag(write(path, rows))


def test_a_contact_that_lasts_moves_evenly(tmp_path):
    bag = sampled(tmp_path / 'bag', {40 * MS: [(1, 3.0)], 20 * MS: [(1, 1.0)]}, [25 * MS])
    (_, _, true), = bag.instants()
    found, = true.contacts
    assert found.position[0] == found.force == pytest.approx(1.5) and found.depth == pytest.approx(0.15)
    assert np.linalg.norm(found.normal) == pytest.approx(1) and found.normal[1] / found.normal[2] == pytest.approx(1.5)
    assert not +bag.unmatched


def test_another_contact_begins_at_its_stamp(tmp_path):
    bag = sampled(tmp_path / 'bag', {0: [], 20 * MS: [(1, 1.0)], 30 * MS: [(2, 2.0)]}, [19 * MS, 29 * MS])
    assert [[contact.position[0] for contact in true.contacts] for _, _, true in bag.instants()] == [[], [1.0]]


def test_beyond_what_is_known_nothing_is(tmp_path):
    bag = sampled(tmp_path / 'bag', {10 * MS: [], 100 * MS: []}, [5 * MS, 50 * MS, 101 * MS])
    assert not list(bag.instants()) and bag.unmatched == {'without truth': 3, 'without an estimate': 2}
