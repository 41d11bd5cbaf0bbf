# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The system under test of hand_soak.py: a hand of cameras and a hand of serial sensors as a user starts them, emulated ports, a
subscriber, and the resources of the hands' processes."""
from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import psutil
import rclpy
import yaml
from rclpy.node import Node
from sensor_msgs.msg import Image
from tactile_bringup.installed import share as shared_file
from tactile_msgs.msg import PsdVoltages

import rendered
from hand_live import SENSORS, anonymous
from soak_trend import Sample

#: sensors on a serial port: module of the emulator; the others have a simulated camera
EMULATORS = {'tip': 'tactile_driver.emulators.psd', 'array': 'tactile_driver.emulators.taxel'}
DOMAIN = int(os.environ.get('ROS_DOMAIN_ID', 96))
_ENVIRONMENT = {'ROS_DOMAIN_ID': str(DOMAIN), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
_PLUGGED_S = 2.0
_FILM_S = 6.0  # s, covers the scenes' first untouched phase, contact and slip
_ENDED_S = 60.0  # s, limit for a hand to end on a busy machine


def pages(folder: Path, share: float) -> dict[str, dict]:
    """The files of the two hands; share: of the full rates. A port's rate is the emulator's matter."""
    cameras = [{'name': name, 'type': kind, 'rate': rate * share, 'scene': scene}
               for name, (kind, rate, _, scene, *_) in SENSORS.items() if name not in EMULATORS]
    ports = [{'name': name, 'type': SENSORS[name][0], 'device': str(folder / name),
              'calibration': shared_file('calibration', f'{SENSORS[name][0]}_sim.yaml')} for name in EMULATORS]
    return {'cameras': {'frame': 'cameras', 'sensors': cameras}, 'ports': {'frame': 'ports', 'sensors': ports}}


def film(folder: Path, share: float) -> None:
    """Draw what the cameras see, at their full rates; at share times the rate it goes so much faster."""
    for name, (_, rate, _, scene, opened, *_) in SENSORS.items():
        if name not in EMULATORS:
            np.save(rendered.file_of(folder, scene, rate * share), rendered.frames_of(opened(scene, rate), _FILM_S))


def environment(folder: Path) -> dict[str, str]:
    """Of the hands: scenes play films, logs go into the folder."""
    paths = [str(Path(__file__).with_name('soak_films')), os.environ.get('PYTHONPATH', '')]
    return {**os.environ, **_ENVIRONMENT, 'ROS_LOG_DIR': str(folder), 'SOAK_FILMS': str(folder),
            'PYTHONPATH': os.pathsep.join(filter(None, paths))}


def name_of(command: Sequence[str], sensors: Collection[str]) -> str:
    """What a process is called: the sensor in whose namespace its nodes are, else its own name."""
    own = next((name for name in sensors if f'__ns:=/{name}' in command), '')
    return own or Path(next((word for word in command if 'python' not in word), 'none')).name


def look(process: psutil.Process, seconds: float) -> Sample:
    """What a process takes now. Memory of no file: libraries and films do not count, and what it was forked with does, so that neither
    writing to that nor the end of another fork looks like growth. Raises OSError or psutil.Error where it is gone."""
    memory, descriptors = anonymous(process.pid, 'Anonymous'), os.listdir(f'/proc/{process.pid}/fd')
    return Sample(round(seconds, 2), process.pid, memory, len(descriptors), process.num_threads())


class Launch:
    """A hand as `ros2 launch` starts it; its log is kept."""

    def __init__(self, name: str, page: dict, source: str, folder: Path, log: Path):
        self._log, self.code = log, None
        self._sensors = [sensor['name'] for sensor in page['sensors']]
        file = folder / f'{name}.yaml'
        file.write_text(yaml.safe_dump(page))
        with open(log, 'w') as output:
            self._process = subprocess.Popen(
                ['ros2', 'launch', 'tactile_bringup', 'hand.launch.py', f'hand:={file}', f'source:={source}'], cwd=folder,
                env=environment(folder), stdout=output, stderr=subprocess.STDOUT,
                start_new_session=True)
        self._root = psutil.Process(self._process.pid)

    def processes(self) -> dict[str, psutil.Process]:
        """Name -> process, launch's own first."""
        found = {'launch': self._root}
        for child in self._root.children(recursive=True):
            try:
                if child.status() != psutil.STATUS_ZOMBIE:
                    found.setdefault(name_of(child.cmdline(), self._sensors), child)
            except psutil.Error:  # it has just ended
                continue
        return found

    def end(self) -> None:
        """Ctrl-C, as a terminal sends it to all of them."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGINT)
        try:
            self.code = self._process.wait(timeout=_ENDED_S)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self.code = self._process.wait()

    def outcome(self) -> dict:
        """Exit code, lines of the log with a traceback, and the log."""
        return {'exit code': self.code, 'tracebacks': self._log.read_text(errors='replace').count('Traceback'), 'log': str(self._log)}


def _subscribe() -> None:
    """A process that takes the largest and the most frequent messages, and that can be stopped."""
    rclpy.init(domain_id=DOMAIN)
    node = Node('soak_subscriber')
    for topic, kind in (('/thumb/image_raw', Image), ('/palm/left/image_raw', Image), ('/tip/voltages', PsdVoltages)):
        node.create_subscription(kind, topic, lambda _message: None, 10, raw=True)
    rclpy.spin(node)


class System:
    """All of it; use it in a with statement. logs: folder for the launches' logs."""

    def __init__(self, folder: Path, logs: Path, share: float):
        self.folder = folder
        film(folder, share)
        self.emulators = {name: subprocess.Popen(
            [sys.executable, '-m', module, '--link', str(folder / name), '--rate', f'{SENSORS[name][1] * share:g}'], cwd=folder,
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, start_new_session=True) for name, module in EMULATORS.items()}
        time.sleep(_PLUGGED_S)
        self.launches = {name: Launch(name, page, 'device' if name == 'ports' else 'sim', folder, logs / f'hand_soak_{name}.log')
                         for name, page in pages(folder, share).items()}
        self.subscriber = multiprocessing.get_context('spawn').Process(target=_subscribe, daemon=True)
        self.subscriber.start()
        self._recorders: list[subprocess.Popen] = []

    def __enter__(self) -> System:
        return self

    def __exit__(self, *_exc) -> None:
        os.kill(self.subscriber.pid, signal.SIGCONT)
        self.subscriber.kill()
        for launch in self.launches.values():
            launch.end()
        for process in (*self.emulators.values(), *self._recorders):
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGINT)
            process.wait(_ENDED_S)

    def processes(self) -> dict[str, psutil.Process]:
        """Name -> process; one that belongs to no sensor is named after its launch too."""
        return {name if name in SENSORS else f'{hand}: {name}': process
                for hand, launch in self.launches.items() for name, process in launch.processes().items()}

    def samples(self, seconds: float) -> dict[str, Sample]:
        """Name -> what it takes now; seconds: since the begin."""
        found = {}
        for name, process in self.processes().items():
            try:
                found[name] = look(process, seconds)
            except (OSError, psutil.Error):  # it has just ended
                continue
        return found

    def type_fault(self, name: str, fault: str) -> None:
        """Make a fault of port_emulator.FAULTS happen at the emulated sensor of this name."""
        self.emulators[name].stdin.write(fault + '\n')
        self.emulators[name].stdin.flush()

    def record(self, name: str, number: int) -> subprocess.Popen:
        """Begin to record a sensor, into a bag of this number; in a group of its own, which takes the Ctrl-C."""
        words = ['ros2', 'run', 'tactile_bringup', 'record_node', '--ros-args', '-r', f'__ns:=/{name}',
                 '-p', f'bag:={self.folder / f"bag{number}"}']
        self._recorders.append(subprocess.Popen(words, cwd=self.folder, env={**os.environ, **_ENVIRONMENT}, start_new_session=True,
                                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        return self._recorders[-1]
