# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes over ROS, from the driver to the contacts: latency from the stamp, lost frames, CPU and memory of each process.

    python test/benchmark/live.py [--sensor touchpad] [--duration 60] [--rate 60] [--scene ...] [--composed true]

The driver (simulated), dot_tracker_node and contact_region_node or contact_point_node run in one process, or with --composed false each in
its own, in a ROS domain of their own; sheets and cushion use the calibration that ships. At first nothing subscribes (--idle s), then this
process subscribes to the last node's result alone. Frames of the first --settle s, while the rest shape is learnt, are not counted. A frame
is lost if the result lacks one of the camera's stamps.
"""
from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
import rclpy
import yaml
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from tactile_bringup.installed import share
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_msgs.msg import ContactRegion, Contacts

from sources import scene_parameters

#: sensor: its nodes; the result that is listened to, and its type
SENSORS = {'touchpad': (('camera_node', 'dot_tracker_node', 'contact_region_node'), 'contact_region', ContactRegion),
           'areal_single': (('camera_node', 'dot_tracker_node', 'contact_point_node'), 'contacts', Contacts),
           'areal_dual': (('dual_camera_node', 'dot_tracker_node', 'contact_point_node'), 'contacts', Contacts),
           'air_cushion': (('camera_node', 'dot_tracker_node', 'contact_point_node'), 'contacts', Contacts)}
DOMAIN = int(os.environ.get('ROS_DOMAIN_ID', 97))
PERCENTILES = (50, 95, 99, 100)


class System:
    """Processes of nodes; use it in a with statement. commands: name of a process -> its command line."""

    def __init__(self, commands: Mapping[str, Sequence[str]], folder: Path):
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(DOMAIN), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
        self.processes = {name: psutil.Popen(command, cwd=folder, env=environment, start_new_session=True)
                          for name, command in commands.items()}

    def __enter__(self) -> System:
        return self

    def __exit__(self, *_exc) -> None:
        for process in self.processes.values():
            process.send_signal(signal.SIGINT)
        for process in self.processes.values():
            process.wait(timeout=30)

    def usage(self) -> dict[str, tuple[float, float]]:
        """Name -> (s of CPU so far, MB of memory of its own and shared)."""
        return {name: (sum(p.cpu_times()[:2]), p.memory_info().rss / 2**20) for name, p in self.processes.items()}


def one_sensor(executables: Sequence[str], parameters: dict, folder: Path, composed: str) -> dict[str, list[str]]:
    """The command lines of a sensor's processes, with parameters by way of a file, as the argument composed has it."""
    file = folder / 'parameters.yaml'
    file.write_text(yaml.safe_dump(parameters))
    groups = {'sensor': executables} if composed == 'true' else {name: [name] for name in executables}
    return {name: [sys.executable, '-m', 'tactile_bringup.nodes.compose', *nodes, '--ros-args', '--params-file', str(file)]
            for name, nodes in groups.items()}


@dataclass
class Record:
    """What was seen: stamps (ns) of camera_info and of the result, latencies s, (time s, usage) now and then."""

    sent: list = field(default_factory=list)
    done: list = field(default_factory=list)
    latencies: list = field(default_factory=list)
    usage: list = field(default_factory=list)


class Listener:
    """Subscribes to a result, and to camera_info for the stamps that there were."""

    def __init__(self, record: Record, topic: str, kind: type):
        self._record = record
        self.node = Node('live_benchmark')
        self.node.create_subscription(kind, topic, self._on_result, 100)
        self.node.create_subscription(CameraInfo, 'camera_info', lambda m: record.sent.append(_stamp(m)), 100)

    def _on_result(self, message) -> None:
        stamp = _stamp(message)
        self._record.latencies.append(1e-9 * (time.time_ns() - stamp))
        self._record.done.append(stamp)


def _stamp(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def watch(system: System, record: Record, duration: float, spin_once) -> None:
    """Let time pass for so many s, and note CPU and memory once a second."""
    begin, noted = time.monotonic(), -1
    while (passed := time.monotonic() - begin) < duration:
        if int(passed) > noted:
            noted = int(passed)
            record.usage.append((time.monotonic(), system.usage()))
        spin_once()


def cpu(record: Record) -> dict[str, float]:
    """Name -> per cent of a core over the record."""
    (t0, first), (t1, last) = record.usage[0], record.usage[-1]
    return {name: 100 * (last[name][0] - first[name][0]) / (t1 - t0) for name in first}


def summary(idle: Record, busy: Record, settle: float) -> dict:
    """All numbers: ms, frames, per cent of a core, MB."""
    begin = busy.sent[0] + settle * 1e9 if busy.sent else 0
    counted = [k for k, stamp in enumerate(busy.done) if stamp > begin]
    latency = 1e3 * np.array([busy.latencies[k] for k in counted])
    last = max(busy.done, default=0)
    sent = {stamp for stamp in busy.sent if begin < stamp <= last}
    memory = {name: [use[name][1] for _, use in busy.usage] for name in busy.usage[0][1]}
    first = min(len(busy.usage) - 1, int(settle))
    return {'frames': len(sent), 'lost': len(sent - set(busy.done)),
            'rate Hz': len(sent) / (1e-9 * (last - begin)) if sent else float('nan'),
            'latency ms': {str(p): float(np.percentile(latency, p)) for p in PERCENTILES} if len(latency) else {},
            'CPU %': cpu(busy), 'CPU % idle': cpu(idle),
            'memory MB': {name: {'first': used[first], 'last': used[-1], 'most': max(used)} for name, used in memory.items()}}


def text(result: dict) -> str:
    """The summary as Markdown."""
    lines = [f'{result["frames"]} frames at {result["rate Hz"]:.1f} Hz, {result["lost"]} lost; latency from the stamp to the result: '
             + ', '.join(f'{value:.1f} ms ({p} %)' for p, value in result['latency ms'].items()), '',
             '| process | CPU % of a core | CPU % with nobody subscribed | memory MB, first | last | most |', '|---|---|---|---|---|---|']
    for name, memory in result['memory MB'].items():
        lines.append(f'| {name} | {result["CPU %"][name]:.1f} | {result["CPU % idle"][name]:.1f} | '
                     + ' | '.join(f'{memory[k]:.0f}' for k in ('first', 'last', 'most')) + ' |')
    return '\n'.join(lines) + '\n'


def parameters_of(sensor: str, scene: str, rate: float) -> dict:
    """A parameter file's content for the nodes of a simulated sensor; scene: '' for the demo."""
    if sensor == 'touchpad':
        own = {'source': 'sim', 'scene': scene or 'demo', 'rate': rate}
        return {'/**': {'ros__parameters': {**scene_parameters(open_scene(own['scene'])), **own}}}
    calibration = share('calibration', f'{sensor}_sim.yaml')
    page = yaml.safe_load(Path(share('params', f'{sensor}_sim.yaml')).read_text())
    for section in page.values():
        if scene and 'scene' in section['ros__parameters']:
            section['ros__parameters']['scene'] = scene
    page['/**']['ros__parameters'] |= {'source': 'sim', 'rate': rate, 'calibration': calibration, 'stitching_path': calibration}
    return page


def run(sensor: str, parameters: dict, composed: str, duration: float, idle: float, settle: float) -> dict:
    """Start the nodes, watch them idle and busy, end them; the summary."""
    executables, topic, kind = SENSORS[sensor]
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    make_room_for_images()
    unused, used = Record(), Record()
    with tempfile.TemporaryDirectory() as folder, \
            System(one_sensor(executables, parameters, Path(folder), composed), Path(folder)) as system:
        time.sleep(5.0)  # imports, not measured
        watch(system, unused, idle, lambda: time.sleep(0.1))
        rclpy.init(domain_id=DOMAIN)
        listener, executor = Listener(used, topic, kind), SingleThreadedExecutor()
        executor.add_node(listener.node)
        try:
            watch(system, used, settle + duration, lambda: executor.spin_once(timeout_sec=0.05))
        finally:
            listener.node.destroy_node()
            rclpy.try_shutdown()
    return summary(unused, used, settle)


def main() -> None:
    """Run, print, write live.md and live.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--duration', type=float, default=60.0, help='s that count')
    parser.add_argument('--idle', type=float, default=10.0, help='s with nobody subscribed')
    parser.add_argument('--settle', type=float, default=5.0, help='s at the start that do not count')
    parser.add_argument('--rate', type=float, default=60.0, help='frames a second')
    parser.add_argument('--sensor', default='touchpad', choices=SENSORS)
    parser.add_argument('--scene', default='', help='of the simulated sensor; its demo where none is given')
    parser.add_argument('--composed', default='true', choices=('true', 'false'), help='one process for all nodes, or one for each')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for live.md and live.json')
    given = parser.parse_args()
    try:
        parameters = parameters_of(given.sensor, given.scene, given.rate)
        result = run(given.sensor, parameters, given.composed, given.duration, given.idle, given.settle)
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / 'live.md').write_text(text(result))
    (given.out / 'live.json').write_text(json.dumps(result, indent=1) + '\n')
    print(text(result))


if __name__ == '__main__':
    main()
