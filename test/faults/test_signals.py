# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""SIGINT, SIGTERM and SIGKILL in each state of a driver: how it ends, that it releases the device, and that the next start works."""
import signal
import time

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

import serial  # noqa: E402
from emulated import CountingFinger  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402
from tactile_msgs.msg import PsdVoltages  # noqa: E402

pytestmark = pytest.mark.ros
CONFIGURE, ACTIVATE, SHUTDOWN = 1, 3, 7
AFTER = {CONFIGURE: 'inactive', ACTIVATE: 'active', SHUTDOWN: 'finalized'}
STATES = {'unconfigured': (), 'inactive': (CONFIGURE,), 'active': (CONFIGURE, ACTIVATE), 'finalized': (CONFIGURE, ACTIVATE, SHUTDOWN)}
STARTED = 20.0  # s, limit for a start, of which discovery may take three
CODES = {signal.SIGINT: 0, signal.SIGTERM: 0, signal.SIGKILL: -9}


class Driver:
    """A driver's process on a port; waits for its lifecycle services unless autostart is set."""

    def __init__(self, bench, port, autostart=False):
        self.bench, self.space, self.begun = bench, bench.fresh('driver'), time.monotonic()
        self.heard = bench.ear.hear(PsdVoltages, f'{self.space}/voltages')
        self.process = bench.zygote.start('tactile_driver.nodes.psd_node', self.space, source='device', device=port,
                                          autostart=str(autostart).lower())

    def _client(self, kind, name):
        client = self.bench.ear.node.create_client(kind, f'{self.space}/psd_node/{name}')
        assert client.wait_for_service(timeout_sec=20.0), self.process.log
        return client

    def bring_to(self, state):
        """Ask for the transitions; the middleware may lose an answer to somebody whom the server has only just met."""
        change, ask = self._client(ChangeState, 'change_state'), self._client(GetState, 'get_state')
        for transition in STATES[state]:
            request = ChangeState.Request()
            request.transition.id = transition
            change.call_async(request)
            self.bench.until(lambda: self._state(ask) == AFTER[transition], 20.0)

    def _state(self, ask):
        future, end = ask.call_async(GetState.Request()), time.monotonic() + 1.0
        while not future.done() and time.monotonic() < end:
            time.sleep(0.005)
        return future.result().current_state.label if future.done() else ''


ALL = [pytest.param(number, list(STATES), marks=pytest.mark.slow, id=f'{number.name} in each state') for number in CODES]
SOME = [pytest.param(number, ['active'], id=f'{number.name} while active') for number in CODES]


@pytest.mark.parametrize(('number', 'states'), ALL + SOME)
def test_a_signal_ends_the_driver_frees_the_device_and_the_next_start_works(bench, beside, bus, number, states):
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    port = bus.folder / 'ttyUSB0'
    for state in states:
        driver = Driver(bench, port)
        driver.bring_to(state)
        sent = time.monotonic()
        driver.process.send(number)
        assert driver.process.wait() == CODES[number], (state, driver.process.log)
        lasted = time.monotonic() - sent
        assert 'Traceback' not in driver.process.log, driver.process.log
        with serial.Serial(str(port), exclusive=True):
            pass
        bench.report(f'{number.name} while {state}', f'exit code {CODES[number]}', lasted)
    last = Driver(bench, port, autostart=True)
    bench.until(lambda: last.heard)
    bench.report(f'start after {number.name}', 'nothing', last.heard[0].at - last.begun, most=STARTED)
    last.process.send(signal.SIGINT)
    assert last.process.wait() == 0
