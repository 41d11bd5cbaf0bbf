# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs in the machine of machine.py: our drivers on the devices of a real kernel; each case is a line of JSON with what was reported.

A case waits for states, as long as it takes: software emulation on a busy host is ten times slower than a computer.
"""
from __future__ import annotations

import json
import sys
import time
import traceback
import tty
from contextlib import contextmanager
from functools import partial
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / 'faults'), str(HERE.parents[1] / 'tactile_driver/test/helpers')]

import numpy as np  # noqa: E402
import rclpy  # noqa: E402
from emulated import frames, samples  # noqa: E402
from fault_rig import ERROR, OK, WARN, Ear, Runner, host  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402

from tactile_driver.camera.device import find_device, list_devices  # noqa: E402
from tactile_driver.camera.v4l2 import VideoNode  # noqa: E402
from tactile_driver.nodes.camera_node import CameraNode  # noqa: E402
from tactile_driver.nodes.dual_camera_node import DualCameraNode  # noqa: E402
from tactile_driver.nodes.psd_node import PsdNode  # noqa: E402
from tactile_driver.nodes.taxel_array_node import TaxelArrayNode  # noqa: E402
from tactile_msgs.msg import PsdVoltages  # noqa: E402

_PATIENCE_S = 180.0  # for each state: three times what a busy machine takes
_SERIAL = {'finger': (PsdNode, PsdVoltages, 'voltages', {'batch_period': 0.05}, samples, 1),
           'array': (TaxelArrayNode, Image, 'image_raw', {'rows': 4, 'columns': 4, 'baud': 921600}, frames, 2)}


class Bench:
    """Nodes of this process and what they say; the host on the other end of a serial line."""

    def __init__(self, line):
        self._line, self.ear, self._count, self.seen, self.nodes = line, Ear(), 0, [], {}

    def say(self, **what) -> None:
        """A line for the host."""
        self._line.write(json.dumps(what).encode() + b'\n')

    def ask(self, device: str, what: str) -> float:
        """Let the host do something to a USB adapter; when it was done, monotonic s."""
        self.say(ask=device, do=what)
        self._line.readline()
        return time.monotonic()

    def until(self, condition, what: str):
        """What condition() returns when it is true. Raises AssertionError, with the last diagnostics, if that never happens."""
        end = time.monotonic() + _PATIENCE_S
        while not (found := condition()):
            last = [f'{name}: {seen[-1].text}' for name, seen in self.ear.health.items() if seen][-2:]
            assert time.monotonic() < end, f'not seen: {what}; /diagnostics: {last}'
            time.sleep(0.01)
        return found

    def reported(self, node: str, level: int, part: str, since: float = 0.0):
        """The first status of a node since a time with the level and the part of text; it is noted."""
        health = self.until(lambda: next((h for h in list(self.ear.health[node]) if h.at > since and h.level == level and part in h.text),
                                         None), f'{("OK", "WARN", "ERROR")[level]} {part!r}')
        self.note(health.text)
        return health

    def note(self, text: str) -> None:
        """Add to what the present case has seen."""
        self.seen.append(text)

    @contextmanager
    def running(self, kind: type, message: type, topic: str, **parameters):
        """A node with a device: (its name on /diagnostics, its messages as they come), when some have come."""
        self._count += 1
        space = f'/n{self._count}'
        heard = self.ear.hear(message, f'{space}/{topic}')
        node = kind(host(space, source='device', **parameters))
        name, runner = f'{space}/{node.get_name()}', Runner(node)
        self.nodes[name] = node
        try:
            self.until(lambda: len(heard) > 3, f'messages of {topic}')
            yield name, heard
        finally:
            runner.end()

    def camera(self, **parameters):
        """As running, of a camera: small and slow, as an emulated processor needs it, unless parameters say otherwise."""
        return self.running(CameraNode, Image, 'image_raw', **{'device': '0', 'width': 320, 'height': 180, 'rate': 10.0, **parameters})

    def serial(self, name: str, **parameters):
        """As running, of the finger or the array, found by its serial number."""
        kind, message, topic, own, *_ = _SERIAL[name]
        return self.running(kind, message, topic, device=f'{name.upper()}1', **{**own, **parameters})

    def goes_on(self, node: str, heard: list, since: float) -> None:
        """Messages come again, and the driver is content; noted with the time that took."""
        came = self.until(lambda: next((h.at for h in list(heard) if h.at > since), None), 'messages after the fault')
        self.note(f'back after {came - since:.2f} s')
        self.reported(node, OK, 'Hz', since)


def control(path: str, name: str, value: int) -> None:
    """Set a control of vivid by its name."""
    with VideoNode(path) as node:
        node.set(next(c.id for c in node.controls() if c.name == name), value)


def of_control(name: str) -> int:
    """The value of a control of the first camera."""
    with VideoNode('/dev/video0') as node:
        return node.get(next(c.id for c in node.controls() if c.name == name))


def bars(heard: list) -> np.ndarray:
    """Mean colours (8, 3 or 1) of the colour bars of the newest image, where vivid writes no text."""
    message = heard[-1].message
    image = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, -1)
    rows = image[message.height * 5 // 8:message.height * 3 // 4].astype(float)
    return np.array([part.mean(axis=(0, 1)) for part in np.array_split(rows, 8, axis=1)])


def formats(bench: Bench) -> None:
    """Each pixel format that OpenCV and vivid share shows the same colours."""
    with VideoNode('/dev/video0') as node:
        offered = {mode.pixel_format for mode in node.modes()}
    bench.note(f'offered: {" ".join(sorted(offered))}')
    shown = {}
    for code in ('YUYV', 'UYVY', 'NV12', 'RGB3', 'BGR3', 'GREY', 'MJPG'):
        if code in offered:
            with bench.camera(pixel_format=code) as (node, heard):
                bench.reported(node, OK, 'Hz')
                shown[code] = bars(heard)
                bench.note(f'{code}: {heard[-1].message.encoding}, {heard[-1].message.width} x {heard[-1].message.height} px')
    for code in set(shown) - {'GREY'}:
        assert np.abs(shown[code] - shown['BGR3']).max() < 12, f'{code} shows {shown[code].round()}, BGR3 {shown["BGR3"].round()}'


def not_offered(bench: Bench) -> None:
    """A size, a rate, a format and a control that vivid has not."""
    with bench.camera(width=300, height=150) as (node, _):
        bench.reported(node, WARN, 'px instead of 300 x 150 px')
    with bench.camera(rate=900.0) as (node, _):
        bench.reported(node, WARN, 'Hz instead of 900 Hz')
    with bench.camera(pixel_format='H264') as (node, _):
        bench.reported(node, WARN, 'instead of H264')
    with bench.camera(exposure=0.01) as (node, _):
        bench.reported(node, WARN, 'exposure 0.01 is not set')


def controls(bench: Bench) -> None:
    """The gain is set, by hand and by the camera, before and while it runs; one that is too large is reported."""
    with bench.camera(gain=60.0) as (node, heard):
        bench.reported(node, OK, 'Hz')
        assert (of_control('Gain'), of_control('Gain, Automatic')) == (60, 0)
        for gain, done in ((80.0, lambda: of_control('Gain') == 80), (0.0, lambda: of_control('Gain, Automatic') == 1)):
            bench.nodes[node].set_parameters([Parameter('gain', value=gain)])
            bench.until(done, f'gain {gain}')
        bench.nodes[node].set_parameters([Parameter('gain', value=1e5)])
        bench.reported(node, WARN, 'gain 100000 is not taken')


def lost_buffers(bench: Bench) -> None:
    """A part of the images never comes."""
    with bench.camera() as (node, heard):
        control('/dev/video0', 'Percentage of Dropped Buffers', 60)
        begin = time.monotonic()
        bench.reported(node, WARN, 'Hz instead of', begin)
        control('/dev/video0', 'Percentage of Dropped Buffers', 0)
        bench.goes_on(node, heard, time.monotonic())


def errored_buffers(bench: Bench) -> None:
    """Images with the flag of an error."""
    with bench.camera() as (node, heard):
        for _ in range(5):
            control('/dev/video0', 'Inject V4L2_BUF_FLAG_ERROR', 1)
            time.sleep(0.1)
        bench.goes_on(node, heard, time.monotonic())
        bench.note(f'corrupt: {bench.ear.health[node][-1].values["corrupt"]}')


def wrong_sequence(bench: Bench) -> None:
    """Sequence numbers and stamps that wrap."""
    with bench.camera() as (node, heard):
        begin = time.monotonic()
        for name in ('Wrap Sequence Number', 'Wrap Timestamp'):
            control('/dev/video0', name, 1)
        bench.until(lambda: sum(h.at > begin for h in list(heard)) > 30, 'images while numbers wrap')
        stamps = [h.message.header.stamp.sec + 1e-9 * h.message.header.stamp.nanosec for h in list(heard)]
        for name in ('Wrap Sequence Number', 'Wrap Timestamp'):
            control('/dev/video0', name, 0)
        late = np.array([h.at + time.time() - time.monotonic() for h in heard][:len(stamps)]) - stamps
        bench.note(f'stamps are {late.min():.3f} to {late.max():.3f} s older than their messages')
        bench.goes_on(node, heard, time.monotonic())


def _fault(bench: Bench, name: str) -> None:
    """The stream breaks off, or the driver disconnects the device."""
    with bench.camera() as (node, heard):
        begin = time.monotonic()
        control('/dev/video0', name, 1)
        bench.reported(node, ERROR, 'check the cable', begin)
        bench.goes_on(node, heard, begin)


def unbound(bench: Bench) -> None:
    """The device is taken from its driver and given back, as an unplugged camera."""
    with bench.camera() as (node, heard):
        begin = time.monotonic()
        Path('/sys/bus/platform/drivers/vivid/unbind').write_text('vivid.0')
        bench.reported(node, ERROR, 'no video device', begin)
        Path('/sys/bus/platform/drivers/vivid/bind').write_text('vivid.0')
        bench.goes_on(node, heard, time.monotonic())


def two_cameras(bench: Bench) -> None:
    """Two cameras are paired and put side by side."""
    small = {'width': 320, 'height': 180, 'rate': 10.0}
    with bench.running(DualCameraNode, Image, 'image_raw', device='0', right_device='1', **small) as (node, heard):
        bench.reported(node, WARN, 'not metric')
        image = heard[-1].message
        bench.note(f'{image.width} x {image.height} px, unpaired: {bench.ear.health[node][-1].values.get("unpaired")}')
        assert (image.width, image.height) == (640, 180)


def selection(bench: Bench) -> None:
    """By index, path, name under by-path, and name of the bus."""
    bench.note('; '.join(map(str, list_devices())))
    by_path = sorted(Path('/dev/v4l/by-path').glob('*'))
    bench.note(f'by-path: {" ".join(p.name for p in by_path)}')
    names = ['1', '/dev/video1', *[str(p) for p in by_path if p.resolve().name == 'video1'], 'platform:vivid-001']
    for name in names:
        assert find_device(name).path == '/dev/video1', name


def _pulled(bench: Bench, name: str) -> None:
    """Its adapter is pulled and put back."""
    *_, numbers, mark = _SERIAL[name]
    with bench.serial(name) as (node, heard):
        begin = bench.ask(name, 'pull')
        bench.reported(node, ERROR, 'device:', begin)
        back = bench.ask(name, 'plug')
        bench.goes_on(node, heard, back)
        assert set(numbers([h.message for h in heard])[:, 1]) == {mark}


def names_of_ports(bench: Bench) -> None:
    """The finger by its name under by-id and by path."""
    by_id = next(Path('/dev/serial/by-id').glob('*FINGER1*'))
    bench.note(f'{by_id.name} -> {by_id.resolve()}')
    for name in (by_id.name, str(by_id), str(by_id.resolve())):
        with bench.running(PsdNode, PsdVoltages, 'voltages', device=name) as (node, _heard):
            bench.reported(node, OK, 'Hz')


def wrong_baud_rate(bench: Bench) -> None:
    """The driver has another one than the sensor."""
    runner = Runner(PsdNode(host('/wrong', source='device', device='FINGER1', baud=9600)))
    try:
        bench.reported('/wrong/psd_node', WARN, 'baud')
    finally:
        runner.end()
    with bench.serial('finger') as (node, _):
        bench.reported(node, OK, 'Hz')


def _bytes(bench: Bench, name: str, what: str, part: str) -> None:
    """Bytes of frames are missing, the begin of each frame comes twice, or chance bytes come as fast as the adapter takes them."""
    *_, numbers, mark = _SERIAL[name]
    with bench.serial(name) as (node, heard):
        begin = bench.ask(name, what)
        bench.until(lambda: any(int(h.values.get(part, 0)) > 2 for h in list(bench.ear.health[node]) if h.at > begin), f'{part} counted')
        right = bench.ask(name, 'well')
        bench.goes_on(node, heard, right)
        values = bench.ear.health[node][-1].values
        bench.note(', '.join(f'{key}: {values[key]}' for key in ('crc errors', 'garbage bytes', 'refused frames', 'dropped')))
        assert set(numbers([h.message for h in heard])[:, 1]) == {mark}, 'a wrong number was published'


#: What is run, in this order.
CASES = {**{case.__name__: case for case in (selection, formats, not_offered, controls, lost_buffers, errored_buffers, wrong_sequence)},
         'fatal_streaming_error': partial(_fault, name='Inject Fatal Streaming Error'), 'disconnect': partial(_fault, name='Disconnect'),
         **{case.__name__: case for case in (unbound, two_cameras, names_of_ports)},
         'finger_pulled': partial(_pulled, name='finger'), 'array_pulled': partial(_pulled, name='array'),
         'wrong_baud_rate': wrong_baud_rate, 'bytes_lost': partial(_bytes, name='finger', what='drop', part='crc errors'),
         'bytes_doubled': partial(_bytes, name='array', what='double', part='garbage bytes'),
         'flood': partial(_bytes, name='finger', what='flood', part='garbage bytes')}


def main(wanted: list[str]) -> None:
    """Run the selected cases, or all, and report to the host."""
    with open('/dev/ttyS1', 'r+b', buffering=0) as line:
        tty.setraw(line)
        rclpy.init()
        bench, begin = Bench(line), time.monotonic()
        booted, release = Path('/proc/uptime').read_text().split()[0], Path('/proc/version').read_text().split()[2]
        bench.say(case='boot', seen=[f'Linux {release}'], seconds=float(booted))
        for name, case in CASES.items():
            if wanted and name not in wanted:
                continue
            bench.seen, begin, failure = [], time.monotonic(), ''
            try:
                case(bench)
            except Exception as error:
                failure = f'{error!r}: {traceback.format_exc()[-800:]}'
            bench.say(case=name, seen=bench.seen, seconds=time.monotonic() - begin, failure=failure)


if __name__ == '__main__':
    main(sys.argv[1:])
