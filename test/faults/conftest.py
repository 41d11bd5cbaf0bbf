# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the fault tests: the test bench, an unaffected sensor beside it, and the report out/faults.md."""
import pathlib

import pytest

HERE = pathlib.Path(__file__).resolve().parent


@pytest.fixture(scope='package')
def bench(tmp_path_factory):
    pytest.importorskip('rclpy', reason='ROS is not sourced')
    pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
    from fault_rig import Bench
    from tactile_driver import emulators
    from tactile_driver.nodes.runtime.run import make_room_for_images
    make_room_for_images()  # listeners here use the same settings as the nodes
    made = Bench(tmp_path_factory.mktemp('faults'))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emulators, '_LARGEST_BACKLOG_NS', 10**10)  # a device keeps sending however busy this machine is
        yield made
    made.close()
    if made.rows:
        lines = [f'| {fault} | {reported} | {seconds:.2f} |' for fault, reported, seconds in made.rows]
        out = HERE.parents[1] / 'out'
        out.mkdir(exist_ok=True)
        (out / 'faults.md').write_text('\n'.join(['| fault | what is reported | recovery (s) |', '|---|---|---|', *lines]) + '\n')


@pytest.fixture(scope='package')
def companion(bench, tmp_path_factory):
    from fault_rig import Beside
    made = Beside(bench, tmp_path_factory.mktemp('beside'))
    yield made
    made.close()


@pytest.fixture
def beside(companion):
    """A sensor runs beside and misses nothing during the test."""
    companion.check()
    yield companion
    companion.check()


@pytest.fixture
def nodes(bench):
    """nodes(Kind, namespace, **parameters): a node in this process, ended after the test; ends it earlier as nodes.end(node)."""
    from fault_rig import Runner, host
    runners = {}

    def start(kind, namespace, **parameters):
        node = kind(host(namespace, **parameters))
        runners[node] = Runner(node)
        return node

    def end(node):
        runners.pop(node).end()
    start.end = end
    yield start
    for node in list(runners):
        end(node)


@pytest.fixture(scope='package')
def idle(bench):
    """idle(sensor type): the nodes of a simulated sensor, made once, whose driver waits to be configured."""
    from sensor_nodes import made, planned
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
    from emulated import Bus
    from tactile_driver.serial import port as serial_port
    made = Bus(tmp_path)
    monkeypatch.setattr(serial_port.list_ports, 'comports', made.comports)
    monkeypatch.setattr(serial_port, '_BY_ID', made.by_id)
    yield made
    made.close()
