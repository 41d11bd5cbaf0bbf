# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag writes bit for bit what the live nodes publish for the same messages, also when it resumes from a checkpoint."""
from pathlib import Path

import cv2
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rosidl_runtime_py.utilities import get_message
from sensor_msgs.msg import CompressedImage
from waiting import until

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_psd_scene, write_scene, write_taxel_scene
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import write_messages
from tactile_perception.bags.replay import Replay
from tactile_perception.core.node import make_node
from tactile_perception.core.sensor_type import SENSOR_TYPES

# sensor type: writer of a scene, the scene, rate in Hz, number of raw messages
SENSORS = {'touchpad': (write_scene, 'disc_twist', 10.0, 24),
           'areal_single': (write_scene, 'areal_single_demo', 5.0, 20),
           'areal_dual': (write_scene, 'areal_dual_fast', 10.0, 24),
           'air_cushion': (write_scene, 'air_cushion_demo', 5.0, 20),
           'psd_finger': (write_psd_scene, 'taps', 1000.0, 60),
           'taxel_array': (write_taxel_scene, 'drag', 20.0, 30)}
COMPRESSED = {'touchpad': '.jpg'}


@pytest.fixture(scope='module', params=[*SENSORS, *(f'{name} compressed' for name in COMPRESSED)])
def sensor(request, tmp_path_factory):
    """(type, files) of a bag of the simulated specimen: bag, parameters, calibration or None."""
    (name, *compressed), folder = request.param.split(), tmp_path_factory.mktemp('bags')
    write, scene, rate, frames = SENSORS[name]
    raw = folder / 'raw' if compressed else folder / name
    write(raw, scene, rate, **({'frames': frames} if write is write_scene else {}))
    if compressed:
        write_messages(folder / name, name, compressed_messages(raw, f'/{name}/image_raw', COMPRESSED[name]))
    calibration = Path(share('calibration', f'{name}_sim.yaml'))
    return name, (folder / name, Path(share('params', f'{name}_sim.yaml')), calibration if calibration.exists() else None)


def compressed_messages(bag, images, kind):
    """(stamp, topic, message) of a bag, with image_raw/compressed in place of image_raw; kind: .jpg or .png."""
    with BagReader(bag) as reader:
        for raw in reader.messages():
            message = decode(raw.data, raw.type_name)
            if raw.topic == images:
                data = cv2.imencode(kind, image_to_array(message))[1].tobytes()
                message = CompressedImage(header=message.header, format=kind[1:], data=data)
            yield raw.stamp_ns, raw.topic + ('/compressed' if raw.topic == images else ''), message


class Bench:
    """A sensor's node and a helper that publishes to it and hears their results, in one process; raw: topic -> type of what it
    publishes."""

    def __init__(self, name, files, raw):
        _, params, calibration = files
        words = ['--params-file', str(params), '-r', f'__ns:=/{name}']
        compressed = [topic for topic, kind in raw.items() if get_message(kind) is CompressedImage]
        words += [word for topic in compressed for word in ('-r', f'{topic}:={topic}/compressed')]
        words += ['-p', f'calibration:={calibration}'] if calibration else []
        rclpy.init(args=['--ros-args', *words])
        self.node = make_node(SENSOR_TYPES[name].perception)
        self.helper = rclpy.create_node('helper', use_global_arguments=False, namespace=f'/{name}')
        self._executor = SingleThreadedExecutor()
        for node in (self.node, self.helper):
            self._executor.add_node(node)
        self.heard = {}
        self.publishers = {topic: self.helper.create_publisher(get_message(kind), topic + '/compressed' * (topic in compressed), 50)
                           for topic, kind in raw.items()}

    def listen(self, topics):
        """Hear these topics (name -> type), once all are joined."""
        for topic, kind in topics.items():
            self.heard[topic] = []
            self.helper.create_subscription(get_message(kind), topic, self.heard[topic].append, 500)
        self.until(lambda: all(publisher.get_subscription_count() for publisher in self.publishers.values()))

    def until(self, condition):
        assert until(condition, self._executor), {topic: len(found) for topic, found in self.heard.items()}

    def close(self):
        self._executor.shutdown()
        for node in (self.node, self.helper):
            node.destroy_node()
        rclpy.try_shutdown()


def frames_of(replay):
    """Raw message by raw message, {topic: [(type, bytes)]} of the estimates."""
    found = []
    for messages in replay:
        estimates = [message for message in messages if message.topic.removeprefix(replay.prefix) in replay.outputs]
        if len(estimates) == len(messages):  # else kept as it was
            found.append({})
        for message in estimates:
            found[-1].setdefault(message.topic, []).append((message.type_name, message.data))
    return found


def test_estimates_are_those_of_the_live_nodes(sensor):
    name, files = sensor
    replay, count = Replay(*files), SENSORS[name][3]
    offline = frames_of(replay)[:count]
    kinds = {topic: items[0][0] for frame in offline for topic, items in frame.items()}
    with replay.open() as reader:
        raw = {replay.raw, f'/{name}/camera_info'} & set(reader.topics)
        bench = Bench(name, files, {topic: reader.topics[topic] for topic in raw})
        try:
            bench.listen(kinds)
            done, expected = 0, dict.fromkeys(kinds, 0)
            for message in reader.messages(raw):
                bench.publishers[message.topic].publish(decode(message.data, message.type_name))
                if message.topic == replay.raw:
                    for topic, items in offline[done].items():
                        expected[topic] += len(items)
                    bench.until(lambda: all(len(bench.heard[topic]) >= n for topic, n in expected.items()))
                    done += 1
                if done == count:
                    break
        finally:
            bench.close()
    assert done == count and sum(expected.values()) > count / 2
    for topic in kinds:
        reported = [data for frame in offline for _, data in frame.get(topic, [])]
        assert [encode(message)[1] for message in bench.heard[topic]] == reported, topic
