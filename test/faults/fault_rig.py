# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in this process and as processes, a listener, and an unaffected sensor that must not lose a sample."""
from __future__ import annotations

import itertools
import re
import subprocess
import threading
import time
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rclpy
from ament_index_python.packages import get_package_prefix
from diagnostic_msgs.msg import DiagnosticArray
from emulated import CountingFinger, samples
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from tactile_bringup.hand.description import HandSensor
from tactile_bringup.launch.arguments import SensorPlan
from tactile_bringup.launch.hand import hand_arguments, planned_sensor
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.diagnostics import NodeDiagnostics
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_msgs.msg import PsdVoltages
from tactile_perception.core.node import make_node

OK, WARN, ERROR = 0, 1, 2
PATIENCE = 60.0  # s, for what takes a second on an idle machine
NodeDiagnostics.period_s = 0.2  # so that tests need not wait


class Heard(NamedTuple):
    """A message, and when it came, monotonic s."""

    at: float
    message: object


def stamps(heard: list[Heard]) -> np.ndarray:
    """(N,) ns, of messages."""
    return np.array([stamp_ns_of(each.message.header) for each in list(heard)])


class Health(NamedTuple):
    """A node's status on /diagnostics."""

    at: float
    level: int
    text: str
    values: dict


class Runner:
    """Spins a node in a thread of its own until it is ended, which destroys it."""

    def __init__(self, node: Node, context: Context | None = None):
        self.node, self._ended = node, False
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._ended:
            self._executor.spin_once(timeout_sec=0.05)
        self._executor.shutdown()
        self.node.destroy_node()

    def end(self) -> None:
        self._ended = True
        self._thread.join(timeout=10)


class Process(subprocess.Popen):
    """A node of a package as its command starts it; its output is gathered in log."""

    def __init__(self, package: str, name: str, words: list[str], path: Path):
        self._path = path
        with path.open('w') as log:
            super().__init__([Path(get_package_prefix(package), 'lib', package, name), *words], stdin=subprocess.DEVNULL, stdout=log,
                             stderr=subprocess.STDOUT, cwd=path.parent, start_new_session=True)

    @property
    def log(self) -> str:
        return self._path.read_text(errors='replace')


class Ear:
    """Listens, in a context of its own. health: node -> what it said of itself; said: what was logged, as (at, node, text)."""

    def __init__(self):
        self._context = Context()
        rclpy.init(context=self._context)
        self.node = Node('ear', context=self._context)
        self.health: dict[str, list[Health]] = defaultdict(list)
        self.said: list[tuple[float, str, str]] = []
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 100)
        self.node.create_subscription(Log, '/rosout', lambda m: self.said.append((time.monotonic(), m.name, m.msg)), 100)
        self._runner = Runner(self.node, self._context)

    def _diagnose(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {entry.key: entry.value for entry in status.values}
            self.health[status.name.split(':')[0]].append(Health(time.monotonic(), ord(status.level), status.message, values))

    def hear(self, kind: type, topic: str, depth: int = 500) -> list[Heard]:
        """What comes on a topic from now on, reliable."""
        heard: list[Heard] = []
        self.node.create_subscription(kind, topic, lambda message: heard.append(Heard(time.monotonic(), message)), QoSProfile(depth=depth))
        return heard

    def close(self) -> None:
        self._runner.end()
        self._context.try_shutdown()


class Bench:
    """What the tests of this folder share: ear, processes, and the rows of the report; folder: for logs."""

    def __init__(self, folder: Path):
        self.rows, self._names, self._folder, self._started = [], itertools.count(1), folder, []
        rclpy.init()
        self.ear = Ear()

    def close(self) -> None:
        for process in self._started:
            process.kill()
        self.ear.close()
        rclpy.try_shutdown()

    def start(self, package: str, name: str, namespace: str, **parameters) -> Process:
        """The process of a node under a namespace, with parameters."""
        given = [word for parameter, value in parameters.items() for word in ('-p', f'{parameter}:={value}')]
        path = self._folder / f'{name}_{len(self._started)}.log'
        self._started.append(Process(package, name, ['--ros-args', '-r', f'__ns:={namespace}', *given], path))
        return self._started[-1]

    def fresh(self, name: str) -> str:
        """A namespace that no test has used: parts of a lifecycle node live on after it."""
        return f'/{name}{next(self._names)}'

    def until(self, condition, known=str) -> float:
        """Monotonic time in s at which condition() came true; if it does not, the error has known() and the last reports of the nodes."""
        end = time.monotonic() + PATIENCE
        while not condition():
            now = time.monotonic()
            assert now < end, (known(), [(name, f'{now - seen[-1].at:.1f} s ago', seen[-1].level, seen[-1].text)
                                         for name, seen in self.ear.health.items() if seen][-6:])
            time.sleep(0.005)
        return time.monotonic()

    def reported(self, node: str, level: int, part: str, since: float = 0.0) -> Health:
        """The first status of a node since a time that has the level and the part of text."""
        found = []
        self.until(lambda: found.extend(h for h in list(self.ear.health[node]) if h.at > since and h.level == level and part in h.text)
                   or found)
        return found[0]

    def recorded(self, space: str) -> int:
        """How many messages the recorder in a namespace says to have."""
        seen = self.ear.health[f'{space}/record_node']
        found = re.match(r'(\d+) messages recorded', seen[-1].text) if seen else None
        return int(found.group(1)) if found else 0

    def logged(self, part: str, since: float = 0.0) -> str:
        """The first line of the log since a time with the part of text."""
        found = []
        self.until(lambda: found.extend(text for at, _, text in list(self.ear.said) if at > since and part in text) or found)
        return found[0]

    def report(self, fault: str, reported: str, seconds: float) -> None:
        """Note what a fault led to; seconds: from its end until all was well."""
        self.rows.append((fault, reported, seconds))


class Beside:
    """A sensor, its driver and its recorder as processes, that run while faults happen to others: no sample may be missing."""

    def __init__(self, bench: Bench, folder: Path):
        self._bench, self._bag, self._done = bench, folder / 'beside', 0
        self._heard = bench.ear.hear(PsdVoltages, '/beside/voltages')
        self._recorder = bench.start('tactile_bringup', 'record_node', '/beside', bag=self._bag, patience=0.0)
        bench.until(lambda: 'record_node' in bench.ear.health or '/beside/record_node' in bench.ear.health)
        self._emulator = CountingFinger(folder / 'beside_port', mark=77, patient=True)
        self._driver = bench.start('tactile_driver', 'psd_node', '/beside', source='device', device=folder / 'beside_port',
                                          batch_period=0.05)
        bench.until(lambda: len(self._heard) > 3)

    def check(self) -> None:
        """Every sample since the last check has come, in order, and more arrive."""
        seen = len(self._heard)
        self._bench.until(lambda: len(self._heard) > seen + 1)
        numbers = samples([h.message for h in self._heard[self._done:]])
        gaps = np.flatnonzero(np.diff(numbers[:, 0]) != 1)
        reported = self._bench.ear.health['/beside/psd_node'][-1:]
        assert not len(gaps) and set(numbers[:, 1]) == {77}, ([numbers[k:k + 2, 0] for k in gaps], reported)
        self._done = len(self._heard) - 1  # keeps the last one, to check that the next one follows it
        assert self._driver.poll() is None and self._recorder.poll() is None

    def close(self) -> None:
        """End all; every sample that was heard is in the bag. The sensor stops first: what a driver that ends has just sent, the middleware
        may still lose to one of those who listen."""
        self._emulator.pull()
        self._bench.until(lambda: time.monotonic() - self._heard[-1].at > 1.0)
        codes = [(process.send_signal(2), process.wait(PATIENCE))[1] for process in (self._driver, self._recorder)]
        heard = samples([h.message for h in self._heard])[:, 0]
        with BagReader(self._bag) as bag:
            recorded = samples([decode(m.data, m.type_name) for m in bag.messages({'/beside/voltages'})])[:, 0]
        assert codes == [0, 0] and (recorded[1:] == recorded[:-1] + 1).all()
        assert recorded[0] <= heard[0] + 300 and recorded[-1] == heard[-1], 'the middleware may take a moment to join the recorder'


def host(namespace: str, **parameters) -> Host:
    """Under a namespace, with parameters."""
    return Host(['-r', f'__ns:={namespace}'], parameters)


def planned(sensor_type: str, space: str) -> SensorPlan:
    """Of a simulated sensor whose driver waits to be configured."""
    given = dict.fromkeys(hand_arguments(), '') | {'source': 'sim', 'autostart': 'false', 'composed': 'true'}
    return planned_sensor(HandSensor(space.strip('/'), sensor_type, 'hand'), given)


def made(plan: SensorPlan, name: str, **more) -> Node:
    """The node of this name as it is alone in a process; more: parameters that it has besides. Raises TactileError."""
    return make_node(name, Host(['-r', f'__ns:=/{plan.namespace}', '--params-file', plan.params], {**plan.nodes[name], **more}))
