# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The processing nodes over ROS: results under the image's header, no work without subscribers, bad frames counted, the reference on
request.
"""
import re
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from waiting import until

from tactile_driver.errors import BadArgument
from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.defect_guard import DefectGuard
from tactile_driver.nodes.runtime.diagnostics import WARN
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, PsdVoltages
from tactile_perception.common.messages import POINTS, RESULTS
from tactile_perception.core.errors import BadCalibration, BadFrame
from tactile_perception.core.node import PerceptionNode, make_node
from tactile_perception.core.stage import Input, Stage
from tactile_perception.dots.parameters import DOT_PARAMETERS
from tactile_perception.dots.stage import DotStage
from tactile_perception.finger.parameters import PSD_PARAMETERS
from tactile_perception.gel.parameters import GEL_PARAMETERS, PINS_PARAMETERS
from tactile_perception.press.parameters import MARKER_PARAMETERS
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS
from tactile_perception.touchpad.parameters import TOUCHPAD_PARAMETERS
from tactile_perception.touchpad.stage import TouchpadStage


class Bench:
    """A touchpad's node, a publisher of images and listeners, in one executor."""

    def __init__(self):
        self.nodes = [make_node('touchpad_contact_node'), rclpy.create_node('bench')]
        self.sensor, self.bench = self.nodes
        self.executor = SingleThreadedExecutor()
        for node in self.nodes:
            self.executor.add_node(node)
        self.scene = open_scene('sphere_press', rate=10.0, seed=3)
        camera = self.scene.camera
        self.calibration = pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
        self.image_out = self.bench.create_publisher(Image, 'image_raw', 10)
        self.info_out = self.bench.create_publisher(CameraInfo, 'camera_info', 10)
        self.seen = {}

    def listen(self, topic, kind):
        self.seen[topic] = []
        return self.bench.create_subscription(kind, topic, self.seen[topic].append, 10)

    def until(self, condition):
        return until(condition, self.executor)

    def show(self, scene_time, spoil=None):
        """Publish the scene at that time; whether both topics went out to somebody."""
        stamp = round((scene_time + 5) * 1e9)
        header = header_of(stamp, 'pad')
        image = image_to_message(Frame(self.scene.render(scene_time).image, stamp, 'bgr8'), '', header)
        if spoil:
            spoil(image)
        self.info_out.publish(calibration_to_message(self.calibration, header))
        self.image_out.publish(image)
        return header

    def close(self):
        self.executor.shutdown()  # or it may hold the nodes' subscriptions
        for node in self.nodes:
            node.destroy_node()


@pytest.fixture
def ros():
    rclpy.init()
    yield
    rclpy.shutdown()


@pytest.fixture
def bench(ros):
    bench = Bench()
    yield bench
    bench.close()


def test_from_image_to_region_with_faults_in_between(bench):
    assert bench.image_out.get_subscription_count() == 0, 'nobody listens yet'
    bench.listen('dots', DotTracks)
    listener = bench.listen('contact_region', ContactRegion)
    assert bench.until(lambda: bench.image_out.get_subscription_count() == 1 and bench.info_out.get_subscription_count() == 1)
    offered = [each.qos_profile for topic in bench.seen for each in bench.bench.get_publishers_info_by_topic(topic)]
    assert [(each.reliability, each.durability) for each in offered] == 2 * [(ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE)]
    header = bench.show(1.0)
    assert bench.until(lambda: bench.seen['contact_region'])
    found = [bench.seen[topic][0].header for topic in ('dots', 'contact_region')]
    assert all((reported.stamp, reported.frame_id) == (header.stamp,
                                                       'touchpad') for reported in found), 'the sensor frame, not that of the image'
    assert len(bench.seen['dots'][0].id) > 520 and bench.seen['contact_region'][0].area == 0

    def cut(image):
        image.data = image.data[:99]
    bench.show(1.1, cut)
    assert bench.until(lambda: bench.sensor.log.refused == 1)
    assert 'do not make the 99 bytes' in bench.sensor.log.last_error
    bench.show(2.4)
    assert bench.until(lambda: len(bench.seen['contact_region']) == 2)
    assert bench.seen['contact_region'][1].area > 10e-6

    client = bench.bench.create_client(Trigger, 'set_reference')
    assert bench.until(client.service_is_ready)
    answer = client.call_async(Trigger.Request())
    assert bench.until(answer.done) and answer.result().success
    bench.show(2.5)
    assert bench.until(lambda: min(map(len, bench.seen.values())) == 3)
    assert max(abs(u) for u in bench.seen['dots'][2].du) == 0

    bench.bench.destroy_subscription(listener)
    bench.show(2.6)
    assert bench.until(lambda: len(bench.seen['dots']) == 4) and len(bench.seen['contact_region']) == 3, 'dots alone'


def test_a_tracker_that_starts_after_its_listener(bench):
    bench.bench.create_subscription(DotTracks, '/late/dots', lambda _message: None, 10)
    assert bench.until(lambda: bench.bench.count_subscribers('/late/dots') == 1)
    tracker = make_node('dot_tracker_node', Host(['-r', '__ns:=/late']))
    try:
        assert bench.until(lambda: bench.bench.count_subscribers('/late/image_raw') == 1)
    finally:
        tracker.destroy_node()


@pytest.mark.parametrize('make, table', [
    ('dot_tracker_node', DOT_PARAMETERS), ('touchpad_contact_node', TOUCHPAD_PARAMETERS), ('press_contact_node', MARKER_PARAMETERS),
    ('gel_contact_node', GEL_PARAMETERS), ('pins_contact_node', PINS_PARAMETERS),
    ('psd_contact_node', PSD_PARAMETERS), ('taxel_contact_node', TAXEL_PARAMETERS)])
def test_no_parameter_is_infinite_or_not_a_number_at_the_start(ros, make, table):
    numbers = [p for p in table if p.type in (float, list[float])]
    settings = [f'{p.name}:={value if p.type is float else [value] * 3}'.replace("'", '') for p in numbers for value in ('.nan', '.inf')]
    for setting in settings:
        with pytest.raises(BadArgument, match=re.escape(setting.split(':=')[0])):
            make_node(make, Host(['-p', setting]))


def test_a_changed_polarity_finds_other_dots_from_the_next_image_on():
    stage, image = DotStage({**defaults(DOT_PARAMETERS), 'polarity': 'dark'}), np.full((240, 320), 60, np.uint8)
    for row, column in np.ndindex(6, 8):
        cv2.circle(image, (25 + 36 * column, 25 + 36 * row), 6, 200, -1)
    messages = [image_to_message(Frame(image, 10**9 + k * 10**8, 'mono8'), '', header_of(10**9 + k * 10**8, 'pad')) for k in range(2)]
    with pytest.raises(BadFrame, match='no pattern of dark dots'):
        stage.process(messages[0])
    bright = {**stage.values, 'polarity': 'bright'}
    stage.check_change(bright)
    stage.change(bright)
    assert len(stage.process(messages[1])['dots'][0].id) == 48
    with pytest.raises(BadArgument, match='neither an image file nor a polygon'):
        stage.check_change({**bright, 'mask': 'none.png'})


class SlowStage(Stage):
    """Takes 25 ms for a message."""

    node, parameters, outputs = 'slow_node', (), {'contacts': Contacts}
    input = Input('voltages', PsdVoltages, depth=200)

    def __init__(self, values):
        super().__init__(values)
        self.resets = 0

    def estimate(self, message, stamp_s, topics):
        time.sleep(0.025)
        return {'contacts': [Contacts(header=message.header)]}

    def reset(self):
        self.resets += 1


class ImageStage(SlowStage):
    """Takes images, and refuses those that cannot be read, as all stages of images."""

    input = Input('image_raw', Image, depth=5)

    def estimate(self, message, stamp_s, topics):
        image_to_array(message)
        return {}


@pytest.mark.parametrize('height, resets', [(4, 1), (5, 0)])
def test_only_images_that_can_be_read_confirm_a_restart(height, resets):
    stage, image = ImageStage({}), np.zeros((4, 6), np.uint8)
    for stamp_s in (100, 1, 2):
        message = image_to_message(Frame(image, stamp_s * 10**9, 'mono8'), '', header_of(stamp_s * 10**9, 'pad'))
        message.height = height if stamp_s < 100 else 4
        with suppress(BadFrame):
            stage.process(message)
    assert stage.resets == resets


@pytest.mark.full
def test_a_slow_node_drops_messages_and_reports_it(ros):
    """How evenly, and how little those that it does have waited: test_work_log.py."""
    node, sender, executor = PerceptionNode(SlowStage), rclpy.create_node('sender'), SingleThreadedExecutor()
    voltages = sender.create_publisher(PsdVoltages, 'voltages', 200)
    heard = []
    sender.create_subscription(Contacts, 'contacts', lambda m: heard.append(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec), 200)
    executor.add_node(node), executor.add_node(sender)
    ended = threading.Event()

    def send():
        while not ended.wait(1 / 60):
            voltages.publish(PsdVoltages(header=header_of(time.time_ns(), 'tip')))
    sending = threading.Thread(target=send, daemon=True)
    sending.start()
    try:
        assert until(lambda: node.log.shed > 20 and len(heard) >= 20, executor), (node.log.shed, len(heard))
        health = node.examine()
    finally:
        ended.set(), sending.join()
        executor.shutdown(), node.destroy_node(), sender.destroy_node()
    assert health.level == WARN and 'of voltages is dropped' in health.message and health.values['dropped'] == node.log.shed
    assert (np.diff(heard) > 0).all()


CAMERA = Path(__file__).parents[3] / 'tactile_driver/test/helpers/foreign_camera.py'
#: what makes Fast DDS something else than it is by itself
PROFILES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE', 'FASTDDS_BUILTIN_TRANSPORTS')


class PictureStage(SlowStage):
    """Takes the images of a camera as a tracker does."""

    node, input = 'picture_node', DotStage.input

    def estimate(self, message, stamp_s, topics):
        return {'contacts': [Contacts(header=message.header)]}


@pytest.mark.full
def test_images_of_a_process_without_our_profile_arrive_and_lost_ones_are_reported(monkeypatch):
    for name in PROFILES:
        monkeypatch.delenv(name, raising=False)
    rclpy.init()
    node = PerceptionNode(PictureStage, Host(['-p', 'use_sim_time:=true']))
    listener, executor = rclpy.create_node('listener'), SingleThreadedExecutor()
    listener.create_subscription(Contacts, 'contacts', lambda _message: None, 200)
    reports = []
    listener.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    executor.add_node(node), executor.add_node(listener)
    camera = subprocess.Popen([sys.executable, str(CAMERA)], stdout=subprocess.PIPE, text=True)
    end = time.monotonic() + 120
    while camera.poll() is None and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown(), node.destroy_node(), listener.destroy_node()
    rclpy.try_shutdown()
    values = {pair.key: pair.value for pair in reports[-1].status[0].values}
    arrived, sent = int(values['frames']) + int(values['dropped']), int(camera.stdout.read())
    assert sent == 54 and arrived > 0.2 * sent, 'a busy machine may lose some'
    assert 1 <= int(values['lost frames']) <= 60 - arrived, 'nobody sees that the very first are missing'
    assert float(values['latency (ms)']) < 30000, 'the stamps are of long ago but by the clock of the player'
    assert any(b'\1' == report.status[0].level and 'are missing' in report.status[0].message for report in reports)


class BrokenStage(SlowStage):
    """Has a defect that voltages of 7 meet."""

    node = 'broken_node'

    def estimate(self, message, stamp_s, topics):
        return {'contacts': [Contacts(header=message.header)] if list(message.voltages) != [7.0] else [][7]}


def test_a_defect_is_counted_and_reported_and_the_stage_restarts(ros, monkeypatch):
    monkeypatch.setattr(DefectGuard, 'strict', False)
    node, sender, executor = PerceptionNode(BrokenStage), rclpy.create_node('sender'), SingleThreadedExecutor()
    voltages, heard, reports = sender.create_publisher(PsdVoltages, 'voltages', 200), [], []
    sender.create_subscription(Contacts, 'contacts', heard.append, 200)
    sender.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    executor.add_node(node), executor.add_node(sender)

    try:
        assert until(lambda: voltages.get_subscription_count() == 1, executor)
        for number in (7.0, 1.0):
            voltages.publish(PsdVoltages(header=header_of(time.time_ns(), 'tip'), voltages=[number]))
        assert until(lambda: heard and node.stage.resets == 1, executor)
        assert until(lambda: any('defect of this software' in pair.value
                                 for report in reports for status in report.status for pair in status.values), executor)
    finally:
        executor.shutdown(), node.destroy_node(), sender.destroy_node()


@pytest.fixture(scope='module')
def done(ball_messages):
    """Dots, and results, of each image."""
    info, images, values, _ = ball_messages
    stage = TouchpadStage(values)
    stage.take('camera_info', info)
    found = [{topic: only for topic, (only,) in stage.process(image).items()} for image in images]
    return [results.pop('dots') for results in found], found


def test_the_stamp_goes_through_and_the_frame_is_the_sensors(ball_messages, done):
    dots, results = done
    for image, message, result in zip(ball_messages[1], dots, results):
        wanted = Header(stamp=image.header.stamp, frame_id='touchpad')
        assert message.header == wanted and set(result) == {*RESULTS, 'points'}
        assert all(part.kind is (RESULTS | POINTS)[topic] and part.header == wanted for topic, part in result.items())


def test_a_ball_is_one_contact_and_rest_is_none(ball_messages, done):
    truth, results = ball_messages[3], done[1]
    for result in results[:2]:
        assert result['contacts'].contacts == [] and result['contact_region'].area == 0 and result['wrench'].wrench.force.z == 0
    contact, = results[2]['contacts'].contacts
    assert contact.depth == pytest.approx(truth.contacts[0].depth, abs=0.3e-3)
    assert contact.force == pytest.approx(truth.contacts[0].force, rel=0.15)
    assert results[2]['wrench'].wrench.force.z == pytest.approx(truth.wrench[2], rel=0.15)
    assert len(results[2]['contact_region'].outlines) == 1


def test_a_stage_that_starts_again_under_a_contact_takes_the_reference_from_the_file(ball_messages, done, tmp_path):
    info, images, values, _ = ball_messages
    values = {**values, 'reference_file': str(tmp_path / 'reference.npy')}

    def contacts(stage, image):
        stage.take('camera_info', info)
        return stage.process(image)['contacts'][0].contacts
    before = TouchpadStage(values)
    assert contacts(before, images[0]) == []
    again = TouchpadStage(values)
    (contact,), (wanted,) = contacts(again, images[2]), done[1][2]['contacts'].contacts
    assert contact.depth == pytest.approx(wanted.depth, abs=0.05e-3) and contact.force == pytest.approx(wanted.force, rel=0.02)
    again.set_reference()
    assert not (tmp_path / 'reference.npy').exists()
    with pytest.raises(BadArgument, match='there is no folder'):
        TouchpadStage({**values, 'reference_file': str(tmp_path / 'none' / 'reference.npy')})


def test_only_what_is_asked_for_becomes_a_message(ball_messages):
    info, images, values, _ = ball_messages
    stage = TouchpadStage(values)
    stage.take('camera_info', info)
    for image, topics in zip(images, (['wrench'], [], ['dots'])):
        assert list(stage.process(image, topics)) == topics


def test_dots_of_another_node_or_a_recording_give_the_same_contact(ball_messages, done):
    info, _, values, _ = ball_messages
    stage = TouchpadStage({**values, 'input': 'dots'})
    stage.take('camera_info', info)
    assert stage.input.topic == 'dots' and 'dots' not in stage.outputs and not stage.has_reference
    for message, of_images in zip(*done):
        results = stage.process(message)
    (contact,), (wanted,) = results['contacts'][0].contacts, of_images['contacts'].contacts
    assert contact.depth == pytest.approx(wanted.depth, abs=1e-6), 'a message holds single precision'


def test_where_contact_is_refused_the_dots_are_published(ball_messages):
    stage = TouchpadStage(ball_messages[2])
    with pytest.raises(BadFrame, match='camera_info') as refused:
        stage.process(ball_messages[1][0])
    assert list(refused.value.partial) == ['dots'] and len(refused.value.partial['dots'][0].id) > 520


def test_a_missing_calibration_is_named_before_anything_runs(ball_messages, tmp_path):
    values = {**ball_messages[2], 'calibration': str(tmp_path / 'none.yaml')}
    with pytest.raises(BadCalibration, match='none.yaml'):
        TouchpadStage(values)
