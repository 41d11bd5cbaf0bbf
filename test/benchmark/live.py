# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors over ROS as a user starts them: latency from the stamp, lost frames, CPU and memory.

    python3 test/benchmark/live.py [thumb index tip array palm] [--composed true] [--duration 20]

The sensors: thumb and index, touchpads of 640 x 480 at 60 frames/s; tip, a PSD finger at 5 kHz; array, a taxel array at 500 frames/s; palm,
a sheet with two cameras at 30. They are started by hand.launch.py, with simulated cameras that play films (films/) and emulated serial
ports. This process subscribes to the last result of each. Latency: from the stamp to the receipt here (a PSD message is stamped with its
first sample). A frame without a result is lost.
"""
from __future__ import annotations

import argparse
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
import rclpy
import yaml
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from tactile_bringup import share
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
DOMAIN = int(os.environ.get('ROS_DOMAIN_ID', 97))
_FILM_S, _STARTED_S, _SETTLE_S, _ENDED_S = 6.0, 180.0, 8.0, 60.0


def film(folder: Path, name: str) -> None:
    """Draw what a camera sees."""
    _, rate, _, scene, *_ = SENSORS[name]
    opened = (open_dual_scene if scene.startswith('areal_dual') else open_scene)(scene, rate)
    seen = [opened.render(number / rate) for number in range(round(_FILM_S * rate))]
    np.save(folder / f'{scene}.npy', np.stack([np.stack(one[:2]) if isinstance(one, tuple) else one.image for one in seen]))


class System:
    """The hands, one of cameras and one of ports, and the emulators; use it in a with statement. Logs go into the folder out."""

    def __init__(self, names: list[str], composed: str, folder: Path, out: Path):
        self.names, self._composed, self._folder = names, composed, folder
        self.emulators = [subprocess.Popen(
            [sys.executable, '-m', SENSORS[name][3], '--link', str(folder / name), '--rate', str(SENSORS[name][1])], cwd=folder,
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True) for name in names if name in PORTS]
        time.sleep(2.0)
        cameras = [{'name': name, 'type': SENSORS[name][0], 'rate': SENSORS[name][1], 'scene': SENSORS[name][3]}
                   for name in names if name not in PORTS]
        ports = [{'name': name, 'type': SENSORS[name][0], 'device': str(folder / name),
                  'calibration': share('calibration', f'{SENSORS[name][0]}_sim.yaml')} for name in names if name in PORTS]
        paths = str(Path(__file__).with_name('films')), os.environ.get('PYTHONPATH', '')
        films = {'LIVE_FILMS': str(folder), 'PYTHONPATH': os.pathsep.join(filter(None, paths))}
        self.logs = {source: out / f'live_{source}.log' for source, sensors in (('sim', cameras), ('device', ports)) if sensors}
        self._launches = [self._launch(source, cameras if source == 'sim' else ports, films if source == 'sim' else {})
                          for source in self.logs]

    def _launch(self, source: str, sensors: list[dict], environment: dict) -> psutil.Popen:
        file = self._folder / f'{source}.yaml'
        file.write_text(yaml.safe_dump({'frame': source, 'sensors': sensors}))
        with open(self.logs[source], 'w') as log:
            return psutil.Popen(['ros2', 'launch', 'tactile_bringup', 'hand.launch.py', f'hand:={file}', f'source:={source}',
                                 f'composed:={self._composed}'], cwd=self._folder, env={**os.environ, **environment}, stdout=log,
                                stderr=subprocess.STDOUT, start_new_session=True)

    def __enter__(self) -> System:
        return self

    def __exit__(self, *_exc) -> None:
        for process in (*self._launches, *self.emulators):
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGINT)
        for process in (*self._launches, *self.emulators):
            process.wait(_ENDED_S)

    def usage(self) -> dict[int, tuple[str, float, float]]:
        """Process -> (sensor whose namespace is in its command line, s of CPU so far, MB of memory that are its own)."""
        found = {}
        for process in (child for launch in self._launches for child in launch.children(recursive=True)):
            try:
                words = process.cmdline()
                for name in (name for name in self.names if f'__ns:=/{name}' in words):
                    found[process.pid] = name, sum(process.cpu_times()[:2]), _own_memory(process.pid)
            except (OSError, psutil.Error):  # it has just ended
                continue
        return found


def _own_memory(pid: int) -> float:
    """MB of memory of no file: what n processes share counts to an n-th; no libraries and none of the films. Raises OSError."""
    rows = [line.split() for line in Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()]
    return next((int(row[1]) for row in rows if row[0] == 'Pss_Anon:'), 0) / 1024


def run(given: argparse.Namespace, folder: Path) -> list[str]:
    """Start everything, listen, end it; a line of the table for each sensor. Raises TimeoutError where one is not heard at all."""
    heard: dict[str, dict[int, int]] = {name: {} for name in given.sensors}  # stamp, ns -> ns from it to the receipt

    def take(name: str, data: bytes) -> None:
        seconds, nanoseconds = struct.unpack_from('<iI', data, 4)  # a result begins with the stamp of its header
        stamp = seconds * 10**9 + nanoseconds
        heard[name][stamp] = time.time_ns() - stamp
    rclpy.init(domain_id=DOMAIN)
    node, executor = Node('live_benchmark'), SingleThreadedExecutor()
    executor.add_node(node)
    for name in given.sensors:
        node.create_subscription(SENSORS[name][5], f'/{name}/{SENSORS[name][4]}', lambda data, name=name: take(name, data), 500, raw=True)

    def spin(seconds: float, until=lambda: False) -> bool:
        end = time.monotonic() + seconds
        while not until() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        return until()
    try:
        with System(given.sensors, given.composed, folder, given.out) as system:
            if not spin(_STARTED_S, lambda: all(heard.values())):
                raise TimeoutError(f'nothing came from {", ".join(name for name in heard if not heard[name])}; see {system.logs}')
            spin(_SETTLE_S)
            begin_ns, first = time.time_ns(), system.usage()
            spin(given.duration)
            last = system.usage()
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return [_line(name, heard[name], given.duration, begin_ns, first, last) for name in given.sensors]


def _line(name: str, heard: dict[int, int], duration: float, begin_ns: int, first: dict, last: dict) -> str:
    late = [1e-6 * value for stamp, value in heard.items() if begin_ns <= stamp < begin_ns + duration * 1e9]
    lived = [pid for pid, (owner, *_) in last.items() if owner == name and pid in first]
    cpu, grown = (sum(last[pid][k] - first[pid][k] for pid in lived) for k in (1, 2))
    latency = ' / '.join(f'{value:.1f}' for value in np.percentile(late, (50, 95, 100))) if late else ''
    return (f'| {name} | {latency} | {max(0.0, 100 * (1 - len(late) / (SENSORS[name][2] * duration))):.1f} | {100 * cpu / duration:.0f} '
            f'| {sum(last[pid][2] for pid in lived):.0f} | {grown:+.1f} |')


def main() -> None:
    """Run, print, write live.md and the logs of the launches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensors', nargs='*', default=list(SENSORS), help=f'of {", ".join(SENSORS)}; all where none is named')
    parser.add_argument('--composed', default='true', choices=('true', 'false'), help='a process for each sensor, or for each node')
    parser.add_argument('--duration', type=float, default=20.0, help='s that count')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for live.md and the logs')
    given = parser.parse_args()
    given.out = given.out.absolute()
    given.out.mkdir(parents=True, exist_ok=True)
    if unknown := set(given.sensors) - set(SENSORS):
        parser.error(f'no sensor {", ".join(unknown)}; choose of {", ".join(SENSORS)}')
    os.environ.update(ROS_DOMAIN_ID=str(DOMAIN), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    make_room_for_images()
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name in set(given.sensors) - set(PORTS):
                film(Path(folder), name)
            lines = run(given, Path(folder))
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    except TimeoutError as error:
        sys.exit(str(error))
    head = [f'composed:={given.composed}, {given.duration:g} s', '',
            '| sensor | latency 50 / 95 / 100 %, ms | lost, % | CPU, % of a core | memory, MB | growth |', '|' + '---|' * 6]
    (given.out / 'live.md').write_text('\n'.join([*head, *lines]) + '\n')
    print((given.out / 'live.md').read_text())


if __name__ == '__main__':
    main()
