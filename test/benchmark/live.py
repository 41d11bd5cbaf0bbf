# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors over ROS as a user starts them: latency from the stamp, lost frames, CPU and memory.

    python3 test/benchmark/live.py [thumb index tip array palm] [--composed true] [--share 1.0] [--duration 20]

The sensors: thumb and index, touchpads of 640 x 480 at 60 frames/s; tip, a PSD finger at 5 kHz; array, a taxel array at 500 frames/s; palm,
a sheet with two cameras at 30; --share scales all rates. They are started by hand.launch.py, with simulated cameras that play films
(films/) and emulated serial ports. This process subscribes to the last result of each. Latency: from the stamp to the receipt here (a PSD
message is stamped with its first sample). A frame without a result is lost.
"""
from __future__ import annotations

import argparse
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
import rclpy
import yaml
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from tactile_bringup.installed import share as shared_file
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene
from tactile_msgs.msg import ContactRegion, Contacts

#: name: type, Hz of the driver, Hz of its results, what it shows, result and its type
SENSORS = {'thumb': ('touchpad', 60, 60, 'demo', 'contact_region', ContactRegion),
           'index': ('touchpad', 60, 60, 'rectangle_drag', 'contact_region', ContactRegion),
           'tip': ('psd_finger', 5000, 200, 'psd_emulator', 'contacts', Contacts),
           'array': ('taxel_array', 500, 500, 'taxel_emulator', 'contacts', Contacts),
           'palm': ('areal_dual', 30, 30, 'areal_dual_demo', 'contacts', Contacts)}
PORTS = ('tip', 'array')
PERCENTILES = (50, 95, 100)
DOMAIN = int(os.environ.get('ROS_DOMAIN_ID', 97))
_FILM_S, _STARTED_S, _SETTLE_S, _ENDED_S = 6.0, 180.0, 8.0, 60.0


@dataclass
class Heard:
    """Of one sensor: stamps (ns) and latencies (s) of its results."""

    stamps: list = field(default_factory=list)
    latencies: list = field(default_factory=list)

    def take(self, data: bytes) -> None:
        """A result as bytes, which begin with the stamp of its header."""
        seconds, nanoseconds = struct.unpack_from('<iI', data, 4)
        stamp, now = seconds * 10**9 + nanoseconds, time.time_ns()
        self.stamps.append(stamp)
        self.latencies.append(1e-9 * (now - stamp))


def film(folder: Path, names: list[str], share: float) -> None:
    """Draw what the cameras see at their full rates; at share times the rate it goes so much faster."""
    for name in set(names) - set(PORTS):
        _, rate, _, scene, *_ = SENSORS[name]
        opened = (open_dual_scene if scene.startswith('areal_dual') else open_scene)(scene, rate)
        seen = [opened.render(number / rate) for number in range(round(_FILM_S * rate))]
        frames = np.stack([np.stack(one[:2]) if isinstance(one, tuple) else one.image for one in seen])
        np.save(folder / f'{scene}_{rate * share:g}.npy', frames)


class System:
    """The hands, one of cameras and one of ports, and the emulators; use it in a with statement. Logs go into the folder out."""

    def __init__(self, names: list[str], composed: str, share: float, folder: Path, out: Path):
        self._environment = {
            **os.environ, 'ROS_DOMAIN_ID': str(DOMAIN), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'LIVE_FILMS': str(folder),
            'PYTHONPATH': os.pathsep.join(filter(None, [str(Path(__file__).with_name('films')), os.environ.get('PYTHONPATH', '')]))}
        self.names, self.emulators = names, {name: subprocess.Popen(
            ['ros2', 'run', 'tactile_driver', SENSORS[name][3], '--link', str(folder / name), '--rate', f'{SENSORS[name][1] * share:g}'],
            cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, start_new_session=True)
            for name in names if name in PORTS}
        time.sleep(2.0)
        cameras = [{'name': name, 'type': SENSORS[name][0], 'rate': SENSORS[name][1] * share, 'scene': SENSORS[name][3]}
                   for name in names if name not in PORTS]
        ports = [{'name': name, 'type': SENSORS[name][0], 'device': str(folder / name),
                  'calibration': shared_file('calibration', f'{SENSORS[name][0]}_sim.yaml')} for name in self.emulators]
        self.logs = {source: out / f'live_{source}.log' for source, sensors in (('sim', cameras), ('device', ports)) if sensors}
        self._launches = [self._launch(source, {'frame': source, 'sensors': {'sim': cameras, 'device': ports}[source]}, composed, folder)
                          for source in self.logs]

    def _launch(self, source: str, page: dict, composed: str, folder: Path) -> psutil.Popen:
        file = folder / f'{source}.yaml'
        file.write_text(yaml.safe_dump(page))
        with open(self.logs[source], 'w') as log:
            return psutil.Popen(['ros2', 'launch', 'tactile_bringup', 'hand.launch.py', f'hand:={file}', f'source:={source}',
                                 f'composed:={composed}'], cwd=folder, env=self._environment, stdout=log, stderr=subprocess.STDOUT,
                                start_new_session=True)

    def __enter__(self) -> System:
        return self

    def __exit__(self, *_exc) -> None:
        for process in (*self._launches, *self.emulators.values()):
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGINT)
        for process in (*self._launches, *self.emulators.values()):
            process.wait(_ENDED_S)

    def of(self, name: str) -> list[psutil.Process]:
        """The processes in whose command line a sensor's namespace is."""
        children = [child for launch in self._launches for child in launch.children(recursive=True)]
        return [child for child in children if f'__ns:=/{name}' in _words(child)]

    def usage(self) -> dict[int, tuple[str, float, float]]:
        """Process -> (sensor, s of CPU so far, MB of memory that are its own)."""
        found = {}
        for name in self.names:
            for process in self.of(name):
                try:
                    found[process.pid] = name, sum(process.cpu_times()[:2]), _own_memory(process.pid)
                except (OSError, psutil.Error):  # it has just ended
                    continue
        return found


def _words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def _own_memory(pid: int) -> float:
    """MB of memory of no file: what n processes share counts to an n-th; no libraries and none of the films. Raises OSError."""
    rows = [line.split() for line in Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()]
    return next((int(row[1]) for row in rows if row[0] == 'Pss_Anon:'), 0) / 1024


def run(given: argparse.Namespace, folder: Path) -> dict:
    """Start everything, listen, end it; the figures. Raises TimeoutError where a sensor is not heard at all."""
    heard = {name: Heard() for name in given.sensors}
    rclpy.init(domain_id=DOMAIN)
    node, executor = Node('live_benchmark'), SingleThreadedExecutor()
    executor.add_node(node)
    for name in given.sensors:
        node.create_subscription(SENSORS[name][5], f'/{name}/{SENSORS[name][4]}', heard[name].take, 500, raw=True)

    def spin(seconds: float, until=lambda: False) -> bool:
        end = time.monotonic() + seconds
        while not until() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        return until()
    try:
        with System(given.sensors, given.composed, given.share, folder, given.out) as system:
            if not spin(_STARTED_S, lambda: all(each.stamps for each in heard.values())):
                silent = ', '.join(name for name, each in heard.items() if not each.stamps)
                raise TimeoutError(f'nothing came from {silent}; see {system.logs}')
            spin(_SETTLE_S)
            begin_ns, first = time.time_ns(), system.usage()
            spin(given.duration)
            last = system.usage()
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    tracebacks = sum(log.read_text(errors='replace').count('Traceback') for log in system.logs.values())
    return {'composed': given.composed, 'share': given.share, 'duration': given.duration, 'tracebacks': tracebacks, 'sensors': {
        name: _figures(name, heard[name], given, begin_ns, first, last) for name in given.sensors}}


def _figures(name: str, heard: Heard, given: argparse.Namespace, begin_ns: int, first: dict, last: dict) -> dict:
    """Lost frames, latency, CPU (% of a core), memory and its growth (MB)."""
    counted = {stamp: late for stamp, late in zip(heard.stamps, heard.latencies) if begin_ns <= stamp < begin_ns + given.duration * 1e9}
    latency = 1e3 * np.array(list(counted.values()))
    lived = [pid for pid, (owner, *_) in last.items() if owner == name and pid in first]
    cpu, grown = (sum(last[pid][k] - first[pid][k] for pid in lived) for k in (1, 2))
    return {'lost %': max(0.0, 100 * (1 - len(counted) / (SENSORS[name][2] * given.share * given.duration))),
            'latency ms': [float(np.percentile(latency, p)) for p in PERCENTILES] if len(latency) else None,
            'CPU %': 100 * cpu / given.duration, 'memory MB': sum(last[pid][2] for pid in lived), 'growth MB': grown}


def text(result: dict) -> str:
    """The result as Markdown."""
    lines = [f'composed:={result["composed"]}, {result["share"]:g} times the full rates, {result["duration"]:g} s, '
             f'{result["tracebacks"]} tracebacks', '',
             '| sensor | latency 50 / 95 / 100 %, ms | lost, % | CPU, % of a core | memory, MB | growth |', '|' + '---|' * 6]
    for name, one in result['sensors'].items():
        late = ' / '.join(f'{value:.1f}' for value in one['latency ms'] or ())
        lines.append(f'| {name} | {late} | {one["lost %"]:.1f} | {one["CPU %"]:.0f} | {one["memory MB"]:.0f} | {one["growth MB"]:+.1f} |')
    return '\n'.join(lines) + '\n'


def main() -> None:
    """Run, print, write live.md, live.json and the logs of the launches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensors', nargs='*', default=list(SENSORS), help=f'of {", ".join(SENSORS)}; all where none is named')
    parser.add_argument('--composed', default='true', choices=('true', 'false'), help='a process for each sensor, or for each node')
    parser.add_argument('--share', type=float, default=1.0, help='of the full rates')
    parser.add_argument('--duration', type=float, default=20.0, help='s that count')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for live.md, live.json and the logs')
    given = parser.parse_args()
    given.out = given.out.absolute()
    given.out.mkdir(parents=True, exist_ok=True)
    if unknown := set(given.sensors) - set(SENSORS):
        parser.error(f'no sensor {", ".join(unknown)}; choose of {", ".join(SENSORS)}')
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    make_room_for_images()
    try:
        with tempfile.TemporaryDirectory() as folder:
            film(Path(folder), given.sensors, given.share)
            result = run(given, Path(folder))
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    except TimeoutError as error:
        sys.exit(str(error))
    (given.out / 'live.md').write_text(text(result))
    (given.out / 'live.json').write_text(json.dumps(result, indent=1) + '\n')
    print(text(result))


if __name__ == '__main__':
    main()
