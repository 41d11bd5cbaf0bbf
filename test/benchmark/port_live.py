# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors on a serial port over ROS: data lost from the port to the results, latency, CPU and memory of each process.

Shared by psd_live.py and taxel_live.py: an emulator sends through a pseudo-terminal; driver and perception run each in its own process, or
with --composed true in one; this process subscribes to the raw messages and to the results.
"""
from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from tactile_driver.nodes.runtime.run import make_room_for_images

import live

PERCENTILES = (50, 95, 99, 100)


@dataclass(frozen=True)
class PortSensor:
    """emulator: module and arguments; executables: the nodes; values: their parameters but source and device; raw: (topic, type); batch:
    (samples, period s) of a raw message; results: topic -> type, the first of which is timed; sample: what one is called."""

    emulator: tuple[str, ...]
    executables: tuple[str, ...]
    values: dict
    raw: tuple[str, type]
    batch: Callable[[object], tuple[int, float]]
    results: dict[str, type]
    sample: str


@dataclass
class Record:
    """batches: (stamp ns, samples, period s) of raw messages; results: stamp ns -> time of receipt ns; usage: as live.Record."""

    batches: list = field(default_factory=list)
    results: dict = field(default_factory=dict)
    usage: list = field(default_factory=list)


class Listener:
    """Notes what comes; results but the first are only received."""

    def __init__(self, sensor: PortSensor, record: Record):
        self._sensor, self._record, self.node = sensor, record, Node('port_live')
        (topic, kind), (timed, *others) = sensor.raw, sensor.results
        self.node.create_subscription(kind, topic, self._on_raw, 500)
        self.node.create_subscription(sensor.results[timed], timed, self._on_result, 500)
        for other in others:
            self.node.create_subscription(sensor.results[other], other, lambda _message: None, 500, raw=True)

    def _on_raw(self, message) -> None:
        self._record.batches.append((live._stamp(message), *self._sensor.batch(message)))

    def _on_result(self, message) -> None:
        self._record.results[live._stamp(message)] = time.time_ns()


def summary(record: Record, settle: float) -> dict:
    """All numbers: samples, ms, per cent of a core and ms of CPU a batch, MB."""
    batches = [b for b in record.batches if b[0] > record.batches[0][0] + settle * 1e9]
    batches = batches[:-20]  # which may still be in transit
    steps = np.array([(after[0] - (stamp + count * period * 1e9)) / (period * 1e9)
                      for (stamp, count, period), after in zip(batches, batches[1:])])
    heard = _receipts(batches, record.results)
    told = np.isfinite(heard)
    latency = np.array([at - stamp - (count - 1) * period * 1e9 for at, (stamp, count, period) in zip(heard, batches)])[told] * 1e-6
    memory = {name: [use[name][1] for _, use in record.usage] for name in record.usage[0][1]}
    first = min(len(record.usage) - 1, int(settle))
    load, rate = live.cpu(record), len(batches) / (1e-9 * (batches[-1][0] - batches[0][0]))
    return {'samples': sum(count for _, count, _ in batches), 'lost samples': int(np.round(steps[steps > 0.5]).sum()),
            'batches': len(batches), 'batches a second': rate, 'batches without results': int((~told).sum()),
            'latency ms': {str(p): float(np.percentile(latency, p)) for p in PERCENTILES}, 'CPU %': load,
            'CPU ms a batch': {name: 10 * part / rate for name, part in load.items()},
            'memory MB': {name: {'first': used[first], 'last': used[-1], 'most': max(used)} for name, used in memory.items()}}


def _receipts(batches: list, results: dict) -> np.ndarray:
    """Time of receipt, ns, of the last result whose stamp is within each batch; NaN without one."""
    stamps = np.array(sorted(results))
    heard = []
    for stamp, count, period in batches:
        first, end = np.searchsorted(stamps, [stamp, stamp + max((count - 0.5) * period * 1e9, 1)])
        heard.append(max((results[each] for each in stamps[first:end].tolist()), default=np.nan))
    return np.array(heard, float)


def text(result: dict, sample: str) -> str:
    """The summary as Markdown; sample: what one is called."""
    latency = ', '.join(f'{value:.1f} ms ({p} %)' for p, value in result['latency ms'].items())
    lines = [f'{result["samples"]} {sample}s in {result["batches"]} messages, {result["batches a second"]:.0f} a second; '
             f'{result["lost samples"]} {sample}s lost before, {result["batches without results"]} messages without results; latency from '
             f'the last of a message to its results: {latency}', '',
             '| process | CPU % of a core | CPU ms a message | memory MB, first | last | most |', '|---|---|---|---|---|---|']
    lines += [f'| {name} | {result["CPU %"][name]:.1f} | {result["CPU ms a batch"][name]:.2f} | '
              + ' | '.join(f'{used[k]:.0f}' for k in ('first', 'last', 'most')) + ' |' for name, used in result['memory MB'].items()]
    return '\n'.join(lines) + '\n'


def run(sensor: PortSensor, composed: str, duration: float, settle: float) -> dict:
    """Start emulator and nodes, listen, end them; the summary."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    make_room_for_images()
    record = Record()
    with tempfile.TemporaryDirectory() as folder:
        port = str(Path(folder) / 'port')
        module, *arguments = sensor.emulator
        emulator = subprocess.Popen([sys.executable, '-m', module, '--link', port, *arguments], stdin=subprocess.PIPE,
                                    stdout=subprocess.DEVNULL, cwd=folder)
        time.sleep(2.0)
        try:
            values = {'source': 'device', 'device': port, **sensor.values}
            commands = live.one_sensor(sensor.executables, {'/**': {'ros__parameters': values}}, Path(folder), composed)
            with live.System(commands, Path(folder)) as system:
                _listen(sensor, system, record, settle + duration)
        finally:
            emulator.send_signal(signal.SIGINT)
            emulator.wait(10)
    return summary(record, settle)


def _listen(sensor: PortSensor, system: live.System, record: Record, seconds: float) -> None:
    rclpy.init(domain_id=live.DOMAIN)
    listener, executor = Listener(sensor, record), SingleThreadedExecutor()
    executor.add_node(listener.node)
    try:
        while not record.results:
            executor.spin_once(timeout_sec=0.1)
        live.watch(system, record, seconds, lambda: executor.spin_once(timeout_sec=0.05))
    finally:
        listener.node.destroy_node()
        rclpy.try_shutdown()


def arguments(text_of_all: str) -> argparse.ArgumentParser:
    """What both commands take."""
    parser = argparse.ArgumentParser(description=text_of_all, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--duration', type=float, default=60.0, help='s that count')
    parser.add_argument('--settle', type=float, default=5.0, help='s at the start that do not count')
    parser.add_argument('--composed', default='true', choices=('true', 'false'), help='one process for all nodes, or one for each')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for the results')
    return parser


def report(sensor: PortSensor, name: str, given: argparse.Namespace) -> None:
    """Run, print, write name.md and name.json."""
    try:
        result = run(sensor, given.composed, given.duration, given.settle)
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / f'{name}.md').write_text(text(result, sensor.sample))
    (given.out / f'{name}.json').write_text(json.dumps(result, indent=1) + '\n')
    print(text(result, sensor.sample))
