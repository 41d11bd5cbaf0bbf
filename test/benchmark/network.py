# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What crosses the network between a hand's computer and another one, and what arrives over a bad link; needs root.

    python3 test/benchmark/network.py [SENSOR ...]

Two network namespaces stand for the computers: HAND has the driver, DESK listens. Between them is a cable, or a relay that delays every
packet and loses some, as tc netem does, which not every kernel has.
"""
from __future__ import annotations

import argparse
import array
import fcntl
import json
import os
import random
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections import deque
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from select import select

from tactile_bringup.sensor_files import parameter_file
from tactile_perception.core.sensor_type import SENSOR_TYPES

HAND, RELAY, DESK = (f'{name}_{os.getpid()}' for name in ('hand', 'relay', 'desk'))
#: Sensor type -> topics of raw data, of results.
SENSORS = {'touchpad': (['image_raw'], ['dots', 'contact_region', 'contacts', 'slip', 'wrench']),
           'taxel_array': (['image_raw'], ['contact_region', 'contacts', 'slip', 'wrench']),
           'psd_finger': (['voltages'], ['contacts'])}
_PATIENCE_S, _SETTLE_S = 60.0, 3.0  # for the first message, and for all others
_CHECKSUMS, _SETTER = 0x17, 0x8946  # ETHTOOL_STXCSUM, SIOCETHTOOL: a relayed packet needs its checksum
_DELAY_MS = 20.0
_SLOW = 5.0  # Hz, of images over the relay, which is a Python program


def within(space: str, *words: str, **how) -> subprocess.Popen:
    """Start a command in a namespace, with a /dev/shm of its own: DDS must not go around the network."""
    shared = Path(tempfile.gettempdir(), space)
    shared.mkdir(exist_ok=True)
    inside = ['ip', 'netns', 'exec', space, 'bash', '-c', f'mount --bind {shared} /dev/shm && exec "$@"', 'bash', *words]
    return subprocess.Popen(inside, env=os.environ | {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}, start_new_session=True, **how)


def own(*words: object) -> list[str]:
    """The words that start a part of this program."""
    return [sys.executable, __file__, *map(str, words)]


@contextmanager
def network(delay_ms: float = 0.0, loss: float = 0.0):
    """Context with the namespaces, joined by a cable, or by the relay where there is a delay or a loss (a share)."""
    ends = {HAND: '10.77.0.1/24', DESK: '10.77.0.2/24'}
    relayed = bool(delay_ms or loss)
    for space in (HAND, RELAY, DESK):
        subprocess.run(['ip', 'netns', 'add', space], check=True)
    try:
        with started() as start:
            links = [('eth0', HAND, 'r0', RELAY), ('eth0', DESK, 'r1', RELAY)] if relayed else [('eth0', HAND, 'eth0', DESK)]
            for name, space, other, there in links:
                subprocess.run(['ip', 'link', 'add', name, 'netns', space, 'type', 'veth', 'peer', 'name', other, 'netns', there],
                               check=True)
            for space, address in ends.items():
                subprocess.run(['ip', '-n', space, 'address', 'add', address, 'dev', 'eth0'], check=True)
                up(space, 'lo', 'eth0')
                if relayed:
                    within(space, *own('checksums', 'eth0')).wait()
            if relayed:
                up(RELAY, 'r0', 'r1')
                start(RELAY, *own('relay', 'r0', 'r1', delay_ms, loss))
            yield start
    finally:
        for space in (HAND, RELAY, DESK):
            subprocess.run(['ip', 'netns', 'delete', space], check=False)
            shutil.rmtree(Path(tempfile.gettempdir(), space), ignore_errors=True)


def up(space: str, *links: str) -> None:
    """Switch links of a namespace on."""
    for link in links:
        subprocess.run(['ip', '-n', space, 'link', 'set', link, 'up'], check=True)


@contextmanager
def started():
    """Context that yields start(space, *words); all that was started ends with it."""
    running = []
    try:
        yield lambda space, *words: running.append(within(space, *words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
    finally:
        for sign in (signal.SIGINT, signal.SIGKILL):
            for process in running:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, sign)
            time.sleep(2.0)


def relay(one: str, other: str, delay_ms: float, loss: float) -> None:
    """Pass the packets between two links on, later, and not all of them."""
    ports = [socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3)) for _ in range(2)]
    for port, name in zip(ports, (one, other)):
        port.setsockopt(socket.SOL_SOCKET, 33, 1 << 26)  # SO_RCVBUFFORCE
        port.bind((name, 0))
    waiting: deque[tuple[float, socket.socket, bytes]] = deque()
    while True:
        now = time.monotonic()
        while waiting and waiting[0][0] <= now:
            _, port, data = waiting.popleft()
            with suppress(OSError):
                port.send(data)
        for port in select(ports, [], [], max(0.0, waiting[0][0] - now) if waiting else 1.0)[0]:
            data, about = port.recvfrom(65536)
            if about[2] != socket.PACKET_OUTGOING and random.random() >= loss:
                waiting.append((time.monotonic() + 1e-3 * delay_ms, ports[port is ports[0]], data))


def compute_checksums(link: str) -> None:
    """Have the kernel write the checksums of what a link sends: a virtual cable does without."""
    value = array.array('B', struct.pack('II', _CHECKSUMS, 0))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        fcntl.ioctl(asked, _SETTER, struct.pack('16sP', link.encode(), value.buffer_info()[0]))


def compress(topic: str, form: str) -> None:
    """Publish the images of a topic as image_transport does."""
    import cv2
    import rclpy
    from sensor_msgs.msg import CompressedImage, Image

    from tactile_driver.nodes.messages.images import image_to_array
    rclpy.init()
    node = rclpy.create_node('compress')
    out = node.create_publisher(CompressedImage, f'{topic}/compressed', 5)
    node.create_subscription(Image, topic, lambda image: out.publish(CompressedImage(
        header=image.header, format=form, data=cv2.imencode(f'.{form}', image_to_array(image))[1].tobytes())), 5)
    rclpy.spin(node)


def listen(seconds: float, topics: list[str]) -> None:
    """Print as JSON what comes on topics (name:type): messages and Mbit a second, latencies, and the words of /diagnostics."""
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.qos import QoSProfile
    from rclpy.serialization import deserialize_message
    from rosidl_runtime_py.utilities import get_message

    from tactile_driver.nodes.runtime.host import SerializedSubscription
    from tactile_driver.nodes.runtime.run import make_room_for_images
    from tactile_driver.recordings.serialization import header_stamp_ns
    make_room_for_images()
    rclpy.init()
    node, words = rclpy.create_node('listen'), {}
    late: dict[str, list[float]] = {}
    size: dict[str, list[int]] = {}

    def take(topic: str, data: bytes, _received_ns: int) -> None:
        late[topic].append(1e-6 * (time.time_ns() - header_stamp_ns(data)))
        size[topic].append(len(data))
    for topic, kind in (each.split(':') for each in topics):
        late[topic], size[topic] = [], []
        SerializedSubscription(node, get_message(kind), topic, partial(take, topic), QoSProfile(depth=10))

    def diagnose(data: bytes) -> None:
        words.update({status.name: status.message for status in deserialize_message(data, DiagnosticArray).status})
    node.create_subscription(DiagnosticArray, '/diagnostics', diagnose, 10, raw=True)

    def spin(until: float) -> None:
        while time.monotonic() < until:
            rclpy.spin_once(node, timeout_sec=0.05)
    patience = time.monotonic() + _PATIENCE_S
    while not any(late.values()) and time.monotonic() < patience:
        spin(time.monotonic() + 0.5)
    spin(time.monotonic() + _SETTLE_S)
    counter, begin = Path('/sys/class/net/eth0/statistics/rx_bytes'), time.monotonic()
    before = int(counter.read_text())
    for found in (*late.values(), *size.values()):
        found.clear()
    spin(begin + seconds)
    span = time.monotonic() - begin
    print(json.dumps({'mbit': 8e-6 * (int(counter.read_text()) - before) / span, 'words': words,
                      'kbit': 8e-3 * sum(map(sum, size.values())) / max(1, *map(len, size.values())),
                      'hz': {topic: len(found) / span for topic, found in late.items()},
                      'ms': {topic: sorted(found)[len(found) // 2] if found else None for topic, found in late.items()}}), flush=True)


def heard(sensor: str, topics: list[str], seconds: float) -> dict:
    """What DESK hears of a sensor's topics."""
    kinds = {'image_raw': 'sensor_msgs/msg/Image', 'voltages': 'tactile_msgs/msg/PsdVoltages', 'wrench': 'geometry_msgs/msg/WrenchStamped',
             'dots': 'tactile_msgs/msg/DotTracks', 'contact_region': 'tactile_msgs/msg/ContactRegion', 'slip': 'tactile_msgs/msg/Slip',
             'contacts': 'tactile_msgs/msg/Contacts', 'image_raw/compressed': 'sensor_msgs/msg/CompressedImage'}
    named = [f'/{sensor}/{topic}:{kinds[topic]}' for topic in topics]
    asked = within(DESK, *own('listen', seconds, *named), stdout=subprocess.PIPE, text=True)
    return json.loads(asked.communicate(timeout=seconds + 120)[0])


def bandwidths(sensor: str, seconds: float) -> list[str]:
    """Rows of the first table."""
    raw, results = SENSORS[sensor]
    with network() as start:
        slow = [f'rate:={_SLOW:g}'] if raw == ['image_raw'] else []
        start(HAND, 'ros2', 'launch', 'tactile_bringup', f'{sensor}.launch.py', *slow)
        found = {'raw': heard(sensor, raw, seconds), 'results': heard(sensor, results, seconds)}
        for form in ('png', 'jpg') if raw == ['image_raw'] else ():
            with started() as beside:
                beside(HAND, *own('compress', f'/{sensor}/image_raw', form))
                found[form] = heard(sensor, ['image_raw/compressed'], seconds)
    return [f'| {sensor} | {name} | {each["kbit"]:.1f} | {max(each["hz"].values()):.1f} | {each["mbit"]:.2f} |'
            for name, each in found.items()]


def over_bad_link(sensor: str, where: str, seconds: float, delay_ms: float, loss: float) -> str:
    """Row of the second table: a sensor's contacts, computed on either computer."""
    kind = SENSOR_TYPES[sensor]
    ros = ['--ros-args', '-r', f'__ns:=/{sensor}', '--params-file', parameter_file(sensor, True)]
    slow = ['-p', f'rate:={_SLOW}'] if SENSORS[sensor][0] == ['image_raw'] else []
    with network(delay_ms, loss) as start:
        start(HAND, 'ros2', 'run', 'tactile_driver', kind.driver, *ros, *slow, '-p', f'frame_id:={sensor}')
        start(where, 'ros2', 'run', 'tactile_perception', kind.perception, *ros)
        found = heard(sensor, ['contacts'], seconds)
    topic, = found['hz']
    late = found['ms'][topic]
    words = '; '.join(f'{name}: {word}' for name, word in sorted(found['words'].items()))
    return (f'| {sensor} | {where.partition("_")[0]} | {100 * loss:g} % | {found["hz"][topic]:.1f} | '
            f'{"-" if late is None else round(late)} | {words} |')


def main() -> None:
    """Run the parts of the program, or all of it."""
    parts = {'relay': lambda one, other, *numbers: relay(one, other, *map(float, numbers)), 'checksums': compute_checksums,
             'compress': compress, 'listen': lambda seconds, *topics: listen(float(seconds), list(topics))}
    if sys.argv[1:2] and sys.argv[1] in parts:
        parts[sys.argv[1]](*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensor', nargs='*', help=f'of {", ".join(SENSORS)} (default: all)')
    parser.add_argument('--seconds', type=float, default=10.0, help='of each measurement')
    given = parser.parse_args()
    print(f'load: {os.getloadavg()[0]:.1f}\n\n| sensor | what crosses | kbit a frame | frames/s | Mbit/s |\n|---|---|---|---|---|')
    for sensor in given.sensor or SENSORS:
        print('\n'.join(bandwidths(sensor, given.seconds)), flush=True)
    print(f'\nWith {_DELAY_MS:g} ms of delay, images at {_SLOW:g} Hz:\n\n'
          '| sensor | perception on | loss | contacts, Hz | latency, ms | /diagnostics |\n|---|---|---|---|---|---|')
    for sensor in given.sensor or SENSORS:
        for where, loss in ((HAND, 0.01), (DESK, 0.0), (DESK, 0.01)):
            print(over_bad_link(sensor, where, given.seconds, _DELAY_MS, loss), flush=True)


if __name__ == '__main__':
    main()
