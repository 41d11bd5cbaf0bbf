# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How long a start takes, from ros2 launch to the first result, and what is heard of a recording that is played from the same moment.

    python3 test/benchmark/starts.py [touchpad areal_dual psd_finger taxel_array] [--rounds 3] [--quick]

Without bytecode: Python finds none and may write none, as before the set-up compiled it. Everything takes turns in each round.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rclpy
from live import DOMAIN
from rclpy.node import Node
from rosbag2_py import ConverterOptions, SequentialWriter, StorageOptions, TopicMetadata
from run import machine
from sensor_msgs.msg import CameraInfo, Image

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_scene
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import header_stamp_ns
from tactile_msgs.msg import Contacts

#: Sensor type -> frames/s at which its recording is played, that two cores keep up with, and how many times.
PLAYED = {'touchpad': (15.0, 3), 'areal_dual': (10.0, 10)}
KINDS = {'image_raw': Image, 'camera_info': CameraInfo}
TYPES = 'touchpad', 'areal_dual', 'psd_finger', 'taxel_array'
_PLAYED_S, _NAMESPACE = 15.0, 'started'  # another namespace than that of the recording
_PATIENCE_S, _ENDED_S, _SILENCE_S = 120.0, 60.0, 3.0


class Ear:
    """Hears when contacts come from a sensor."""

    def __init__(self):
        rclpy.init(domain_id=DOMAIN)
        self.node = Node('starts_benchmark')

    @contextmanager
    def on(self, namespace: str) -> Iterator[dict[int, float]]:
        """Stamp, ns, of each result of a sensor -> when it came, time.monotonic(); it grows while this spins."""
        heard: dict[int, float] = {}
        subscription = self.node.create_subscription(
            Contacts, f'/{namespace}/contacts', lambda data: heard.setdefault(header_stamp_ns(data), time.monotonic()), 500, raw=True)
        yield heard
        self.node.destroy_subscription(subscription)

    def spin(self, seconds: float) -> None:
        """Take what comes within so many s."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            rclpy.spin_once(self.node, timeout_sec=left)

    def wait(self, heard: dict[int, float]) -> float:
        """The time of the first result. Raises TimeoutError."""
        end = time.monotonic() + _PATIENCE_S
        while not heard:
            if time.monotonic() > end:
                raise TimeoutError(f'no result within {_PATIENCE_S:g} s')
            rclpy.spin_once(self.node, timeout_sec=0.1)
        return min(heard.values())


@contextmanager
def launched(words: list[str], environment: dict) -> Iterator[float]:
    """The time, time.monotonic(), of the start of ros2 launch; Ctrl-C at the end."""
    begin = time.monotonic()
    process = subprocess.Popen(['ros2', 'launch', 'tactile_bringup', *words], env={**os.environ, **environment}, start_new_session=True,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield begin
    finally:
        os.killpg(process.pid, signal.SIGINT)
        process.wait(_ENDED_S)


def first_result(ear: Ear, sensor: str, composed: bool, environment: dict) -> float:
    """s from ros2 launch of a simulated sensor to its first result."""
    with ear.on(sensor) as heard, launched([f'{sensor}.launch.py', f'composed:={str(composed).lower()}'], environment) as begin:
        return ear.wait(heard) - begin


def process_bag(bag: Path, environment: dict) -> float:
    """s that process_bag takes to say that a bag has no image."""
    begin = time.monotonic()
    subprocess.run(['ros2', 'run', 'tactile_perception', 'process_bag', str(bag), str(bag.parent / 'never')], capture_output=True,
                   env={**os.environ, **environment})
    return time.monotonic() - begin


def empty_bag(bag: Path) -> Path:
    """A bag with a topic of images and no message."""
    writer = SequentialWriter()
    writer.open(StorageOptions(uri=str(bag), storage_id='mcap'), ConverterOptions())
    writer.create_topic(TopicMetadata(id=0, name='/touchpad/image_raw', type='sensor_msgs/msg/Image', serialization_format='cdr'))
    del writer
    return bag


def played(ear: Ear, sensor: str, bag: Path) -> tuple[float, int, int]:
    """A recording that this process plays from the moment of the launch: s to the first result, results, and frames from the one
    of the first result on; (NaN, 0, 0) without any."""
    with BagReader(bag) as reader:
        messages = list(reader.messages({topic for topic in reader.topics if topic.endswith(tuple(KINDS))}))
    offered = {'camera_info': LATCHED_QOS, 'image_raw': 10}  # as the recording offers them
    publishers = {topic: ear.node.create_publisher(KINDS[name := topic.rpartition('/')[2]], topic, offered[name])
                  for topic in sorted({message.topic for message in messages})}
    topics = [topic for topic in publishers if topic.endswith('image_raw')]
    words = [f'{sensor}.launch.py', f'namespace:={_NAMESPACE}', 'source:=topics',
             *(f'{name}:={topic}' for name, topic in zip(('topic', 'right_topic'), topics)),
             f'params:={share("params", f"{sensor}_sim.yaml")}']
    calibration = Path(share('calibration', f'{sensor}_sim.yaml'))
    words += [f'calibration:={calibration}'] if calibration.exists() else []
    with ear.on(_NAMESPACE) as heard, launched(words, {}) as begin:
        for message in messages:
            ear.spin(begin + 1e-9 * (message.stamp_ns - messages[0].stamp_ns) - time.monotonic())
            publishers[message.topic].publish(message.data)
        ear.spin(_SILENCE_S)
    for publisher in publishers.values():
        ear.node.destroy_publisher(publisher)
    if not heard:
        return np.nan, 0, 0
    frames = [header_stamp_ns(message.data) for message in messages if message.topic == topics[0]]
    return min(heard.values()) - begin, len(heard), sum(stamp >= min(heard) for stamp in frames)


def _range(values) -> str:
    return f'{np.median(values):.1f} ({np.min(values):.1f} to {np.max(values):.1f})' if len(values) else '-'


def starts(ear: Ear, sensors: Sequence[str], rounds: int, folder: Path) -> list[str]:
    """Lines of the table of starts."""
    nowhere = folder / 'no_bytecode'
    bare = {'PYTHONDONTWRITEBYTECODE': '1', 'PYTHONPYCACHEPREFIX': str(nowhere)}
    empty = empty_bag(folder / 'empty')
    measured = {f'{sensor}, {"composed" if composed else "a process a node"}': lambda environment, sensor=sensor, composed=composed:
                first_result(ear, sensor, composed, environment) for sensor in sensors for composed in (True, False)}
    measured['process_bag on an empty bag'] = lambda environment: process_bag(empty, environment)
    found = {name: ([], []) for name in measured}
    for _ in range(rounds):
        for name, measure in measured.items():
            for values, environment in zip(found[name], ({}, bare)):
                values.append(measure(environment))
                print(f'{name}: {values[-1]:.2f} s', file=sys.stderr, flush=True)
    return [f'| {name} | {" | ".join(map(_range, pair))} |' for name, pair in found.items()]


def recordings(ear: Ear, seconds: float, is_quick: bool, folder: Path) -> list[str]:
    """Lines of the table of recordings that are played while a sensor starts."""
    lines = []
    for sensor, (rate, rounds) in PLAYED.items():
        bag = folder / sensor
        write_scene(bag, f'{sensor}_demo' if sensor == 'areal_dual' else 'demo', rate, frames=round(seconds * rate))
        runs = np.array([played(ear, sensor, bag) for _ in range(1 if is_quick else rounds)])
        first, results, frames = runs[runs[:, 1] > 0].T
        lines.append(f'| {sensor}, {rate:g} Hz, {seconds:g} s | {len(runs)} | {len(first)} | {_range(first)} '
                     f'| {_range(100 - 100 * results / frames)} |')
    return lines


def main() -> None:
    """Run, print, write starts.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensors', nargs='*', default=TYPES, help=f'sensor types; {", ".join(TYPES)} where none is named')
    parser.add_argument('--rounds', type=int, default=3, help='starts of each kind')
    parser.add_argument('--quick', action='store_true', help='one start of the finger and of each recording, to see that it runs')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for starts.md')
    given = parser.parse_args()
    os.environ.update(ROS_DOMAIN_ID=str(DOMAIN), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    make_room_for_images()
    about, ear = machine(), Ear()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        begun = starts(ear, ('psd_finger',) if given.quick else given.sensors, 1 if given.quick else given.rounds, folder)
        shown = recordings(ear, _PLAYED_S, given.quick, folder)
    rclpy.shutdown()
    text = '\n'.join([
        f'`{" ".join(["starts.py", *sys.argv[1:]])}`, {about["date"]}: {about["processor"]}, {about["cores"]} processors, load before '
        f'{about["load"]:.1f}. Median (range).', '', '| start | first result after, s | without bytecode, s |', '|---|---|---|', *begun, '',
        '| recording, played from the moment of the launch | starts | that gave results | first result after, s | lost from then on, % |',
        '|' + '---|' * 5, *shown])
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / 'starts.md').write_text(text + '\n')
    print(text)


if __name__ == '__main__':
    main()
