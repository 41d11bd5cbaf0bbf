# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors over ROS as a user starts them: latency from the stamp, lost frames, CPU and memory.

    python3 test/benchmark/live.py [thumb index tip array palm] [--composed true] [--duration 20] [--quick]

The sensors: thumb and index, touchpads of 640 x 480 at 60 frames/s; tip, a PSD finger at 1 kHz; array, a taxel array at 200 frames/s; palm,
a sheet with two cameras at 30; --rate tip=5000 sets another. They are started by hand.launch.py, with simulated cameras that play films
(films/) and emulated serial ports. This process subscribes to the last result of each. Latency: from the stamp to the receipt here (a PSD
message is stamped with its first sample). A frame without a result is lost; of the finger, whose messages hold what has come in each 5 ms,
the samples that its driver or its contact node report as lost or dropped.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import psutil
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from run import machine

from tactile_bringup import share
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.recordings.serialization import header_stamp_ns
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene
from tactile_msgs.msg import ContactRegion, Contacts

#: name: type, Hz of the driver, what it shows, result and its type
SENSORS = {'thumb': ('touchpad', 60, 'demo', 'contact_region', ContactRegion),
           'index': ('touchpad', 60, 'rectangle_drag', 'contact_region', ContactRegion),
           'tip': ('psd_finger', 1000, 'psd_emulator', 'contacts', Contacts),
           'array': ('taxel_array', 200, 'taxel_emulator', 'contacts', Contacts),
           'palm': ('areal_dual', 30, 'areal_dual_demo', 'contacts', Contacts)}
PORTS = ('tip', 'array')
DOMAIN = int(os.environ.get('ROS_DOMAIN_ID', 97))
_STARTED_S, _ENDED_S = 180.0, 60.0
_REPORTED_S = 1.5  # nodes report once a second
_LENGTHS = {False: (6.0, 8.0, 20.0), True: (1.0, 3.0, 5.0)}  # --quick: s of a film, of settling, and that count


def film(folder: Path, name: str, rate: float, duration: float) -> None:
    """Draw what a camera sees."""
    scene = SENSORS[name][2]
    opened = (open_dual_scene if scene.startswith('areal_dual') else open_scene)(scene, rate)
    seen = [opened.render(number / rate) for number in range(round(duration * rate))]
    np.save(folder / f'{scene}.npy', np.stack([np.stack(one[:2]) if isinstance(one, tuple) else one.image for one in seen]))


class System:
    """The hands, one of cameras and one of ports, and the emulators; use it in a with statement. Logs go into the folder out."""

    def __init__(self, rates: dict[str, float], composed: str, folder: Path, out: Path):
        names = self.names = list(rates)
        self._composed, self._folder = composed, folder
        self.emulators = [subprocess.Popen(
            ['ros2', 'run', 'tactile_driver', SENSORS[name][2], '--link', str(folder / name), '--rate', str(rates[name])], cwd=folder,
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True) for name in names if name in PORTS]
        _wait_for_ports([folder / name for name in names if name in PORTS])
        cameras = [{'name': name, 'type': SENSORS[name][0], 'rate': rates[name], 'scene': SENSORS[name][2]}
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


def _wait_for_ports(links: list[Path]) -> None:
    """Raises TimeoutError where an emulator makes no port."""
    end = time.monotonic() + _STARTED_S
    while missing := [link.name for link in links if not link.exists()]:
        if time.monotonic() > end:
            raise TimeoutError(f'the emulators made no port for {", ".join(missing)}')
        time.sleep(0.1)


def _own_memory(pid: int) -> float:
    """MB of memory of no file: what n processes share counts to an n-th; no libraries and none of the films. Raises OSError."""
    rows = [line.split() for line in Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()]
    return next((int(row[1]) for row in rows if row[0] == 'Pss_Anon:'), 0) / 1024


class Lost:
    """What the nodes of each sensor report on /diagnostics as lost or dropped."""

    def __init__(self, node: Node):
        self._counts: dict[tuple[str, str], int] = {}
        node.create_subscription(DiagnosticArray, '/diagnostics', self._take, 100)

    def _take(self, message: DiagnosticArray) -> None:
        self._counts.update(((status.name, value.key), int(value.value)) for status in message.status for value in status.values
                            if value.key in ('lost frames', 'dropped') and value.value.isdigit())

    def of(self, names: Iterable[str]) -> dict[str, int]:
        """Sensor -> count so far."""
        return {name: sum(count for (node, _), count in self._counts.items() if node.startswith(f'/{name}/')) for name in names}


def run(given: argparse.Namespace, rates: dict[str, float], folder: Path) -> list[str]:
    """Start everything, listen, end it; a line of the table for each sensor. Raises TimeoutError where one is not heard at all."""
    heard: dict[str, dict[int, int]] = {name: {} for name in rates}  # stamp, ns -> ns from it to the receipt

    def take(name: str, data: bytes) -> None:
        stamp = header_stamp_ns(data)
        heard[name][stamp] = time.time_ns() - stamp
    rclpy.init(domain_id=DOMAIN)
    node, executor = Node('live_benchmark'), SingleThreadedExecutor()
    executor.add_node(node)
    for name in rates:
        node.create_subscription(SENSORS[name][4], f'/{name}/{SENSORS[name][3]}', lambda data, name=name: take(name, data), 500, raw=True)

    lost = Lost(node)

    def spin(seconds: float, until=lambda: False) -> bool:
        end = time.monotonic() + seconds
        while not until() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        return until()
    try:
        with System(rates, given.composed, folder, given.out) as system:
            if not spin(_STARTED_S, lambda: all(heard.values())):
                raise TimeoutError(f'nothing came from {", ".join(name for name in heard if not heard[name])}; see {system.logs}')
            spin(_LENGTHS[given.quick][1])
            begin_ns, first, begun = time.time_ns(), system.usage(), lost.of(rates)
            spin(given.duration)
            last = system.usage()
            spin(_REPORTED_S)
            ended = lost.of(rates)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    lines = [_line(name, rate, heard[name], ended[name] - begun[name], given.duration, begin_ns, first, last)
             for name, rate in rates.items()]
    cpu, memory = _used(None, first, last, given.duration)[:2]
    return [*lines, f'| all | | | | {cpu:.0f} | {memory:.0f} | |']


def _used(name: str | None, first: dict, last: dict, duration: float) -> tuple[float, float, float]:
    """CPU in % of a core, memory in MB and its growth, of a sensor's processes; None: of all."""
    lived = [pid for pid, (owner, *_) in last.items() if name in (None, owner) and pid in first]
    cpu, grown = (sum(last[pid][k] - first[pid][k] for pid in lived) for k in (1, 2))
    return 100 * cpu / duration, sum(last[pid][2] for pid in lived), grown


def _line(name: str, rate: float, heard: dict[int, int], lost: int, duration: float, begin_ns: int, first: dict, last: dict) -> str:
    late = [1e-6 * value for stamp, value in heard.items() if begin_ns <= stamp < begin_ns + duration * 1e9]
    cpu, memory, grown = _used(name, first, last, duration)
    latency = ' / '.join(f'{value:.1f}' for value in np.percentile(late, (50, 95, 100))) if late else ''
    count = rate * duration
    share = (lost if name == 'tip' else max(0.0, count - len(late))) / count
    return f'| {name} | {len(late) / duration:.1f} | {latency} | {100 * share:.1f} | {cpu:.0f} | {memory:.0f} | {grown:+.1f} |'


def main() -> None:
    """Run, print, write live.md and the logs of the launches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensors', nargs='*', default=list(SENSORS), help=f'of {", ".join(SENSORS)}; all where none is named')
    parser.add_argument('--composed', default='true', choices=('true', 'false'), help='a process for each sensor, or for each node')
    parser.add_argument('--duration', type=float, help='s that count, in place of 20')
    parser.add_argument('--rate', nargs='*', default=[], metavar='NAME=HZ', help='another rate of a sensor')
    parser.add_argument('--quick', action='store_true', help='half a minute in all, to see that it runs')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for live.md and the logs')
    given = parser.parse_args()
    given.out = given.out.absolute()
    given.out.mkdir(parents=True, exist_ok=True)
    given.duration = given.duration or _LENGTHS[given.quick][2]
    try:
        changed = {name: float(value) for name, value in (one.split('=') for one in given.rate)}
    except ValueError:
        parser.error(f'--rate {" ".join(given.rate)}: must be NAME=HZ')
    if unknown := {*given.sensors, *changed} - set(SENSORS):
        parser.error(f'no sensor {", ".join(unknown)}; choose of {", ".join(SENSORS)}')
    rates = {name: changed.get(name, SENSORS[name][1]) for name in given.sensors}
    os.environ.update(ROS_DOMAIN_ID=str(DOMAIN), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    make_room_for_images()
    load = os.getloadavg()[0]
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name in set(rates) - set(PORTS):
                film(Path(folder), name, rates[name], _LENGTHS[given.quick][0])
            lines = run(given, rates, Path(folder))
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    except TimeoutError as error:
        sys.exit(str(error))
    about = machine()
    head = [f'`{" ".join(["live.py", *sys.argv[1:]])}`, {given.duration:g} s, {about["date"]}: {about["processor"]}, '
            f'{about["cores"]} processors, which also play and emulate the sensors; load before {load:.1f}', '',
            '| sensor | results, Hz | latency 50 / 95 / 100 %, ms | lost, % | CPU, % of a core | memory, MB | growth |', '|' + '---|' * 7]
    (given.out / 'live.md').write_text('\n'.join(['# Rates and latency of live sensors', '', *head, *lines]) + '\n')
    print((given.out / 'live.md').read_text())


if __name__ == '__main__':
    main()
