# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A hand over ROS: CPU, memory, latency and lost frames of 1, 2 and 5 sensors, with one process per sensor or per node.

    python test/benchmark/hand_live.py [--counts 1 2 5] [--composed true false] [--duration 20] [--repeat 3] [--share 1.0]

The sensors are, in this order: two touchpads of 640 x 480 at 60 frames per second, a PSD finger at 1 kHz, a taxel array at 200 frames per
second and a sheet with two cameras at 30; --share scales all rates. Their frames are rendered beforehand (rendered.py). This process
subscribes to the last result of each sensor as serialized messages. Configurations alternate, --repeat times, and medians are reported.
Growth: of the memory in the --duration s that count.
Latency: from the stamp to the receipt here (5 ms more for a PSD message, stamped with its first sample). A frame without a result is lost.
"""
from __future__ import annotations

import argparse
import itertools
import json
import os
import struct
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from tactile_bringup.hand.description import HandSensor
from tactile_bringup.launch.hand import planned_sensor
from tactile_bringup.launch.arguments import SensorPlan, own_parameters
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.simulation.psd.scene import open_psd_scene
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene
from tactile_driver.simulation.taxel.scene import open_taxel_scene
from tactile_msgs.msg import ContactRegion, Contacts

import live
import rendered

#: name: type, Hz of the driver, Hz of its results, scene, what opens it, result and its type
SENSORS = {'thumb': ('touchpad', 60, 60, 'demo', open_scene, 'contact_region', ContactRegion),
           'index': ('touchpad', 60, 60, 'rectangle_drag', open_scene, 'contact_region', ContactRegion),
           'tip': ('psd_finger', 1000, 200, 'demo', open_psd_scene, 'contacts', Contacts),
           'array': ('taxel_array', 200, 200, 'demo', open_taxel_scene, 'contacts', Contacts),
           'palm': ('areal_dual', 30, 30, 'areal_dual_demo', open_dual_scene, 'contacts', Contacts)}
WAYS = ('true', 'false')
_GIVEN = {'hand': '', 'source': 'sim', 'path': '', 'autostart': '', 'loop': '', 'record': '', 'composed': 'true'}
_FILM_S = 6.0
_STARTED_S = 6.0  # s for imports


def plan(names: Sequence[str], share: float) -> dict[str, SensorPlan]:
    """The nodes of each sensor, as hand.launch.py plans them."""
    settings = {name: {'rate': f'{SENSORS[name][1] * share:g}', 'scene': SENSORS[name][3]} for name in names}
    return {name: planned_sensor(HandSensor(name, SENSORS[name][0], 'hand', settings=settings[name]), _GIVEN) for name in names}


def film(folder: Path, share: float) -> None:
    """Render what all sensors send."""
    for _, rate, _, scene, opened, *_ in SENSORS.values():
        if not rendered.file_of(folder, scene, rate * share).exists():
            np.save(rendered.file_of(folder, scene, rate * share), rendered.frames_of(opened(scene, rate * share), _FILM_S))


def command(plan: SensorPlan, nodes: Iterable[str], films: Path) -> list[str]:
    """The command line of a process of some of a sensor's nodes, which plays the films."""
    return [sys.executable, str(Path(__file__).with_name('rendered.py').absolute()), str(films), *nodes, '--ros-args',
            '-r', f'__ns:=/{plan.namespace}', '--params-file', plan.params, '--params-file', own_parameters(plan)]


class Hand(live.System):
    """The processes of a hand; use it in a with statement."""

    def __init__(self, plans: Mapping[str, SensorPlan], way: str, films: Path):
        super().__init__({label: command(plan, nodes, films) for plan in plans.values()
                          for label, nodes in ({plan.frame: plan.nodes} if way == 'true' else
                                               {f'{plan.frame}/{node}': [node] for node in plan.nodes}).items()}, films)

    def memory(self) -> float:
        """MB that are theirs alone, what they share once: no libraries, and none of the frames that they play."""
        return sum(anonymous(process.pid) for process in self.processes.values())


def anonymous(pid: int, row: str = 'Pss_Anon') -> float:
    """MB of memory of no file: what is shared by n processes to an n-th, or with row Anonymous whole. Raises OSError where it has ended."""
    rows = [line.split() for line in Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()]
    taken = [int(each[1]) for each in rows if each[0] == f'{row}:']
    if not taken:
        raise ProcessLookupError(f'process {pid} has ended')
    return taken[0] / 1024


def stamp_in(data: bytes) -> int:
    """ns: the stamp of a message as bytes, with which its header begins."""
    seconds, nanoseconds = struct.unpack_from('<iI', data, 4)
    return seconds * 10**9 + nanoseconds


@dataclass
class Heard:
    """Of one sensor: stamps (ns) and latencies (s) of its results."""

    stamps: list = field(default_factory=list)
    latencies: list = field(default_factory=list)

    def take(self, data: bytes) -> None:
        """A result as bytes."""
        stamp = stamp_in(data)
        self.stamps.append(stamp)
        self.latencies.append(1e-9 * (time.time_ns() - stamp))


def run(names: Sequence[str], way: str, share: float, duration: float, settle: float, films: Path) -> dict:
    """Start the processes, listen, end them; the summary."""
    heard, record = {name: Heard() for name in names}, live.Record()
    with Hand(plan(names, share), way, films) as hand:
        time.sleep(_STARTED_S)
        rclpy.init(domain_id=live.DOMAIN)
        node, executor = Node('hand_benchmark'), SingleThreadedExecutor()
        executor.add_node(node)
        for name in names:
            node.create_subscription(SENSORS[name][6], f'/{name}/{SENSORS[name][5]}', heard[name].take, 500, raw=True)
        try:
            live.watch(hand, live.Record(), settle, lambda: executor.spin_once(timeout_sec=0.05))
            begin, at_first = time.time_ns(), hand.memory()
            live.watch(hand, record, duration, lambda: executor.spin_once(timeout_sec=0.05))
            memory = hand.memory()
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
    return summary(heard, record, share, begin, duration) | {'memory MB': memory, 'growth MB': memory - at_first}


def summary(heard: dict[str, Heard], record: live.Record, share: float, begin_ns: int, duration: float) -> dict:
    """CPU, per cent of a core, of all processes; of each sensor the lost part of its frames, %, and latency, ms. Stamps before begin_ns do
    not count."""
    result = {'CPU %': sum(live.cpu(record).values()), 'sensors': {}}
    for name, found in heard.items():
        counted = [(stamp, late) for stamp, late in zip(found.stamps, found.latencies) if begin_ns <= stamp < begin_ns + duration * 1e9]
        due = rate_of(name, share) * duration
        told = len({stamp for stamp, _ in counted})
        latency = 1e3 * np.array([late for _, late in counted])
        result['sensors'][name] = {'lost %': max(0.0, 100 * (1 - told / due)), 'latency ms': [
            float(np.percentile(latency, p)) if len(latency) else float('nan') for p in live.PERCENTILES]}
    return result


def rate_of(name: str, share: float) -> float:
    """Results a second that are due. A finger's batches have whole samples, of 5 ms together."""
    kind, rate, results = SENSORS[name][:3]
    return rate * share / max(round(0.005 * rate * share), 1) if kind == 'psd_finger' else results * share


def medians(results: list[dict]) -> dict:
    """Of runs of one kind, number by number."""
    sensors = {name: {'lost %': float(np.median([r['sensors'][name]['lost %'] for r in results])),
                      'latency ms': np.median([r['sensors'][name]['latency ms'] for r in results], axis=0).tolist()}
               for name in results[0]['sensors']}
    return {name: float(np.median([r[name] for r in results])) for name in ('CPU %', 'memory MB', 'growth MB')} | {'sensors': sensors}


def text(table: dict[tuple[int, str], dict]) -> str:
    """The medians as Markdown; key: (number of sensors, way)."""
    lines = ['| sensors | processes | CPU % of a core | memory MB, and growth | latency 50 % / 95 % ms, and lost, of each |',
             '|---|---|---|---|---|']
    for (count, way), result in sorted(table.items()):
        each = ', '.join(f'{name} {s["latency ms"][0]:.1f} / {s["latency ms"][1]:.1f}, {s["lost %"]:.1f} %'
                         for name, s in result['sensors'].items())
        memory = f'{result["memory MB"]:.0f}, {result["growth MB"]:+.1f}'
        lines.append(f'| {count} | composed:={way} | {result["CPU %"]:.0f} | {memory} | {each} |')
    return '\n'.join(lines) + '\n'


def main() -> None:
    """Run, print, write hand_live.md and hand_live.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--counts', type=int, nargs='+', default=[1, 2, 5], help='how many of the sensors')
    parser.add_argument('--composed', nargs='+', default=WAYS, choices=WAYS, help='ways to run them, as the argument of hand.launch.py')
    parser.add_argument('--duration', type=float, default=20.0, help='s that count')
    parser.add_argument('--settle', type=float, default=8.0, help='s at the start that do not count')
    parser.add_argument('--repeat', type=int, default=3, help='runs of each kind')
    parser.add_argument('--share', type=float, default=1.0, help='of the full rates')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for hand_live.md and hand_live.json')
    given = parser.parse_args()
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    make_room_for_images()
    results: dict[tuple[int, str], list[dict]] = {}
    try:
        with tempfile.TemporaryDirectory() as folder:
            film(Path(folder), given.share)
            for _, count, way in itertools.product(range(given.repeat), given.counts, given.composed):
                names = list(SENSORS)[:count]
                results.setdefault((count, way), []).append(run(names, way, given.share, given.duration, given.settle, Path(folder)))
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    table = {key: medians(runs) for key, runs in results.items()}
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / 'hand_live.md').write_text(text(table))
    (given.out / 'hand_live.json').write_text(json.dumps({f'{count} {way}': r for (count, way), r in table.items()}, indent=1) + '\n')
    print(text(table))


if __name__ == '__main__':
    main()
