# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the fault tests: the test bench, an unaffected sensor beside it, and the report out/faults.md."""
import pathlib
from dataclasses import replace

import pytest
from emulated import Bus
from fault_rig import Bench, Beside, Runner, host, made, planned

from tactile_driver import emulators
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.serial import port as serial_port

OUT = pathlib.Path(__file__).resolve().parents[2] / 'out'


@pytest.fixture(scope='package')
def bench(tmp_path_factory):
    make_room_for_images()  # listeners here use the same settings as the nodes
    bench = Bench(tmp_path_factory.mktemp('faults'))
    with pytest.MonkeyPatch.context() as patch:
        # a device keeps sending however busy this machine is
        patch.setattr(emulators, 'DRIVER', replace(emulators.DRIVER, max_backlog_ns=10**10))
        yield bench
    bench.close()
    if bench.rows:
        lines = [f'| {fault} | {reported} | {seconds:.2f} |' for fault, reported, seconds in bench.rows]
        OUT.mkdir(exist_ok=True)
        (OUT / 'faults.md').write_text('\n'.join(['| fault | what is reported | recovery (s) |', '|---|---|---|', *lines]) + '\n')


@pytest.fixture(scope='package')
def companion(bench, tmp_path_factory):
    companion = Beside(bench, tmp_path_factory.mktemp('beside'))
    yield companion
    companion.close()


@pytest.fixture
def beside(companion):
    """A sensor runs beside and misses nothing during the test."""
    companion.check()
    yield companion
    companion.check()


@pytest.fixture
def nodes(bench):
    """nodes(Kind, namespace, **parameters): a node in this process, ended after the test."""
    runners = []

    def start(kind, namespace, **parameters):
        runners.append(Runner(kind(host(namespace, **parameters))))
        return runners[-1].node
    yield start
    for runner in runners:
        runner.end()


@pytest.fixture(scope='package')
def idle(bench):
    """idle(sensor type): the nodes of a simulated sensor, made once, whose driver waits to be configured."""
    kept = {}

    def nodes_of(sensor_type):
        if sensor_type not in kept:
            plan = planned(sensor_type, bench.fresh('idle'))
            kept[sensor_type] = [made(plan, name) for name in plan.nodes]
        return kept[sensor_type]
    yield nodes_of
    for node in sum(kept.values(), []):
        node.destroy_node()


@pytest.fixture
def bus(tmp_path, monkeypatch):
    """Serial ports in place of /dev."""
    bus = Bus(tmp_path)
    monkeypatch.setattr(serial_port.list_ports, 'comports', bus.comports)
    monkeypatch.setattr(serial_port, '_BY_ID', bus.by_id)
    yield bus
    bus.close()
