# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger over ROS, from a serial port to contacts: samples lost, latency, CPU and memory of each process.

    python test/benchmark/psd_live.py [--duration 60] [--rate 5000] [--batch-period 0.005] [--out out/benchmark]

The emulator sends frames of five samples through a pseudo-terminal; psd_node and psd_contact_node run as processes of their own with the
calibration that ships. This process listens to voltages and contacts. Latency: from the last sample of a batch to the receipt of its
contacts here. A sample is lost where the stamps of voltages leave a gap, or a batch has no contacts. What the emulator itself did not send
in time on a busy machine counts as lost too.
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
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from tactile_bringup.sensor_launch import share
from tactile_msgs.msg import Contacts, PsdVoltages

sys.path.insert(0, str(Path(__file__).parent))
import live  # noqa: E402

MODULES = ('tactile_driver.nodes.psd_node', 'tactile_perception.nodes.psd_contact_node')
PERCENTILES = (50, 95, 99, 100)


@dataclass
class Record:
    """batches: (stamp ns, samples, period s) of voltages; contacts: stamp ns -> time of receipt ns; usage: as live.Record."""

    batches: list = field(default_factory=list)
    contacts: dict = field(default_factory=dict)
    usage: list = field(default_factory=list)


class Listener:
    """Notes what comes."""

    def __init__(self, record: Record):
        self._record, self.node = record, Node('psd_live')
        self.node.create_subscription(PsdVoltages, 'voltages', self._on_voltages, 500)
        self.node.create_subscription(Contacts, 'contacts', self._on_contacts, 500)

    def _on_voltages(self, message: PsdVoltages) -> None:
        self._record.batches.append((live._stamp(message), len(message.voltages) // 4, message.sample_period))

    def _on_contacts(self, message: Contacts) -> None:
        self._record.contacts[live._stamp(message)] = time.time_ns()


def summary(record: Record, settle: float) -> dict:
    """All numbers: samples, ms, per cent of a core, MB."""
    batches = [b for b in record.batches if b[0] > record.batches[0][0] + settle * 1e9]
    batches = batches[:-20]  # what may be still on its way
    steps = np.array([(after[0] - (stamp + count * period * 1e9)) / (period * 1e9)
                      for (stamp, count, period), after in zip(batches, batches[1:])])
    told = [(stamp, count, period) for stamp, count, period in batches if stamp in record.contacts]
    latency = np.array([record.contacts[stamp] - stamp - (count - 1) * period * 1e9 for stamp, count, period in told]) * 1e-6
    memory = {name: [use[name][1] for _, use in record.usage] for name in record.usage[0][1]}
    first = min(len(record.usage) - 1, int(settle))
    return {'samples': sum(count for _, count, _ in batches), 'lost samples': int(np.round(steps[steps > 0.5]).sum()),
            'batches': len(batches), 'batches without contacts': len(batches) - len(told),
            'latency ms': {str(p): float(np.percentile(latency, p)) for p in PERCENTILES}, 'CPU %': live.cpu(record),
            'memory MB': {name: {'first': used[first], 'last': used[-1], 'most': max(used)} for name, used in memory.items()}}


def text(result: dict) -> str:
    """The summary as Markdown."""
    lines = [f'{result["samples"]} samples in {result["batches"]} batches, {result["lost samples"]} samples lost, '
             f'{result["batches without contacts"]} batches without contacts; latency from the last sample to the contacts: '
             + ', '.join(f'{value:.1f} ms ({p} %)' for p, value in result['latency ms'].items()), '',
             '| process | CPU % of a core | memory MB, first | last | most |', '|---|---|---|---|---|']
    lines += [f'| {name} | {result["CPU %"][name]:.1f} | ' + ' | '.join(f'{used[k]:.0f}' for k in ('first', 'last', 'most')) + ' |'
              for name, used in result['memory MB'].items()]
    return '\n'.join(lines) + '\n'


def run(rate: float, batch_period: float, duration: float, settle: float) -> dict:
    """Start emulator and nodes, listen, end them; the summary."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    record = Record()
    with tempfile.TemporaryDirectory() as folder:
        port = str(Path(folder) / 'port')
        emulator = subprocess.Popen([sys.executable, '-m', 'tactile_driver.emulator', '--link', port, '--rate', str(rate)],
                                    stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, cwd=folder)
        values = {'source': 'device', 'device': port, 'batch_period': batch_period,
                  'calibration': share('calibration', 'psd_finger_sim.yaml')}
        time.sleep(2.0)
        try:
            with live.System(MODULES, {'/**': {'ros__parameters': values}}, Path(folder)) as system:
                _listen(system, record, settle + duration)
        finally:
            emulator.send_signal(signal.SIGINT)
            emulator.wait(10)
    return summary(record, settle)


def _listen(system: live.System, record: Record, seconds: float) -> None:
    rclpy.init(domain_id=live.DOMAIN)
    listener, executor = Listener(record), SingleThreadedExecutor()
    executor.add_node(listener.node)
    try:
        while not record.contacts:
            executor.spin_once(timeout_sec=0.1)
        live.watch(system, record, seconds, lambda: executor.spin_once(timeout_sec=0.05))
    finally:
        listener.node.destroy_node()
        rclpy.try_shutdown()


def main() -> None:
    """Run, print, write psd_live.md and psd_live.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--duration', type=float, default=60.0, help='s that count')
    parser.add_argument('--settle', type=float, default=5.0, help='s at the start that do not count')
    parser.add_argument('--rate', type=float, default=5000.0, help='samples a second')
    parser.add_argument('--batch-period', type=float, default=0.005, help='s')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for psd_live.md and psd_live.json')
    given = parser.parse_args()
    try:
        result = run(given.rate, given.batch_period, given.duration, given.settle)
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / 'psd_live.md').write_text(text(result))
    (given.out / 'psd_live.json').write_text(json.dumps(result, indent=1) + '\n')
    print(text(result))


if __name__ == '__main__':
    main()
