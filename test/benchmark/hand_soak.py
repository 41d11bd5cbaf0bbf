# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Resource leaks of a hand: five sensors at four times the rates that two cores can process, with a fault every ten seconds.

    python test/benchmark/hand_soak.py [--duration 1200] [--period 10] [--share 4] [--out out/benchmark]

The sensors are those of hand_live.py, in two hands, since a hand has one source; each is started by `ros2 launch tactile_bringup
hand.launch.py`. The cameras of one are simulated and play films (soak_films); the sensors of the other are emulated on pseudo-terminals.
--share is relative to the full rates, which need about two cores. The faults of soak_faults.py occur in turn, none in the last 30 s.
This process subscribes to the last result of each sensor, and samples once a second each process below the launches: anonymous memory
(Anonymous in smaps_rollup), MB, file descriptors and threads. Slopes: soak_trend.py.
"""
from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import psutil
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from tactile_driver.nodes.runtime.run import make_room_for_images

from hand_live import SENSORS, rate_of
from soak_faults import Faults, Heard
from soak_system import DOMAIN, System
from soak_trend import Sample, trend

_STARTED_S = 180.0  # s, limit for the start of a load beyond what the machine can run
_QUIET_S = 30.0  # s without faults at the end, in which the last killed process restarts
_LOOK_S = 1.0
_SPIN_S = 0.05
_MB = 2**20


def run(given: argparse.Namespace, folder: Path) -> dict:
    """Start everything, let the faults happen, end it; all that was found. Raises TimeoutError where a sensor is not heard at all."""
    heard, samples = {name: Heard() for name in SENSORS}, {}
    rclpy.init(domain_id=DOMAIN)
    node, executor = Node('hand_soak'), SingleThreadedExecutor()
    executor.add_node(node)
    for name, (*_, topic, kind) in SENSORS.items():
        node.create_subscription(kind, f'/{name}/{topic}', heard[name].take, 500, raw=True)
    try:
        with System(folder, given.out, given.share) as system:
            faults = Faults(system, node, heard)
            _start(executor, heard)
            busy, shared = psutil.cpu_percent(), [shutil.disk_usage('/dev/shm').used / _MB]
            _soak(given, executor, system, faults, samples)
            busy, shared = psutil.cpu_percent(), [*shared, shutil.disk_usage('/dev/shm').used / _MB]
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return {'duration': given.duration, 'share': given.share, 'busy %': busy, '/dev/shm MB': shared,
            'sensors': {name: sensor_summary(name, each, given.share, given.duration) for name, each in heard.items()},
            'processes': {name: trend(found, given.duration, given.settle) for name, found in sorted(samples.items())},
            'faults': faults.told,
            'launches': {name: launch.outcome() for name, launch in system.launches.items()}, 'samples': samples}


def _start(executor: SingleThreadedExecutor, heard: dict[str, Heard]) -> None:
    """Wait for a result of each; what came so far does not count."""
    end = time.monotonic() + _STARTED_S
    while silent := [name for name, each in heard.items() if not each.count]:
        if time.monotonic() > end:
            raise TimeoutError(f'nothing was heard of {", ".join(silent)}; see the logs')
        executor.spin_once(timeout_sec=_SPIN_S)
    for each in heard.values():
        each.count = 0


def _soak(given: argparse.Namespace, executor: SingleThreadedExecutor, system: System, faults: Faults,
          samples: dict[str, list[Sample]]) -> None:
    begin = time.monotonic()
    looked, happened = 0, 0
    while (passed := time.monotonic() - begin) < given.duration:
        executor.spin_once(timeout_sec=_SPIN_S)
        faults.go_on()
        if passed > looked * _LOOK_S:
            looked = int(passed / _LOOK_S) + 1
            for name, sample in system.samples(passed).items():
                samples.setdefault(name, []).append(sample)
        if (happened + 1) * given.period < passed < given.duration - _QUIET_S:
            happened += 1
            faults.happen()


def sensor_summary(name: str, heard: Heard, share: float, duration: float) -> dict:
    """Results that were asked for and that came, a second; how often it was killed, after how many s it was back (None: never)."""
    return {'asked Hz': rate_of(name, share), 'heard': heard.count, 'heard Hz': heard.count / duration,
            'killed': len(heard.kills), 'back s': [back for _, back in heard.kills]}


def text(result: dict) -> str:
    """The results as Markdown."""
    shared = result['/dev/shm MB']
    lines = [f'{result["duration"]:.0f} s at {result["share"]:g} times the full rates, {len(result["faults"])} faults; all that ran on the '
             f'machine kept it busy for {result["busy %"]:.0f} % of the time; its /dev/shm: {shared[0]:.0f} MB at the begin, '
             f'{shared[1]:.0f} at the end', '',
             '| process | lives | MB first | last | MB an hour | flat | fds first | last | an hour | flat | threads |',
             '|' + '---|' * 11]
    for name, each in result['processes'].items():
        lines.append(f'| {name} | {each["lives"]} | {_cells(each["memory"], 1)} | {_cells(each["fds"], 0)} | {each["threads"]} |')
    lines += ['', '| sensor | results asked for, Hz | heard, Hz | killed | back after s |', '|' + '---|' * 5]
    for name, each in result['sensors'].items():
        back = ', '.join('never' if seconds is None else f'{seconds:.1f}' for seconds in each['back s'])
        lines.append(f'| {name} | {each["asked Hz"]:.0f} | {each["heard Hz"]:.1f} | {each["killed"]} | {back} |')
    lines += ['', '| fault | answer | times |', '|---|---|---|']
    lines += [f'| {fault} | {answer} | {times} |'
              for (fault, answer), times in Counter((told['fault'], told['answer']) for told in result['faults']).items()]
    lines += ['', *(f'{name}: exit code {each["exit code"]}, {each["tracebacks"]} tracebacks in {each["log"]}'
                    for name, each in result['launches'].items())]
    return '\n'.join(lines) + '\n'


def _cells(found: dict, digits: int) -> str:
    return (f'{found["first"]:.{digits}f} | {found["last"]:.{digits}f} | {found["an hour"]:.1f} ± {found["error"]:.1f} | '
            f'{"yes" if found["flat"] else "no"}')


def main() -> None:
    """Run, print, write hand_soak.md, hand_soak.json and the logs of the launches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--duration', type=float, default=1200.0, help='s')
    parser.add_argument('--period', type=float, default=10.0, help='s from one fault to the next')
    parser.add_argument('--share', type=float, default=4.0, help='of the full rates')
    parser.add_argument('--settle', type=float, default=150.0,
                        help='s at the begin of each life of a process that do not count: what is kept for later is still being filled')
    parser.add_argument('--out', type=Path, default=Path('out/benchmark'), help='folder for hand_soak.md, hand_soak.json and the logs')
    given = parser.parse_args()
    given.out = given.out.absolute()
    given.out.mkdir(parents=True, exist_ok=True)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    make_room_for_images()
    try:
        with tempfile.TemporaryDirectory() as folder:
            result = run(given, Path(folder))
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit('interrupted')
    except TimeoutError as error:
        sys.exit(str(error))
    (given.out / 'hand_soak.md').write_text(text(result))
    (given.out / 'hand_soak.json').write_text(json.dumps(result) + '\n')
    print(text(result))


if __name__ == '__main__':
    main()
