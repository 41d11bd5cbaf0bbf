# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""SIGINT, SIGTERM and SIGKILL in each state of a driver's life: how it ends, that the device is free, that the next start works."""
import signal
import time

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

import serial  # noqa: E402
from emulated import CountingFinger  # noqa: E402
from lifecycle_msgs.msg import TransitionEvent  # noqa: E402
from lifecycle_msgs.srv import ChangeState  # noqa: E402
from tactile_msgs.msg import PsdVoltages  # noqa: E402

pytestmark = pytest.mark.ros
CONFIGURE, ACTIVATE, SHUTDOWN = 1, 3, 7
AFTER = {CONFIGURE: 'inactive', ACTIVATE: 'active', SHUTDOWN: 'finalized'}
STATES = {'unconfigured': (), 'inactive': (CONFIGURE,), 'active': (CONFIGURE, ACTIVATE), 'finalized': (CONFIGURE, ACTIVATE, SHUTDOWN)}
STARTED = 20.0  # s: the middleware may take three to join the listener
CODES = {signal.SIGINT: 0, signal.SIGTERM: 0, signal.SIGKILL: -9}


class Driver:
    """A driver's process on a port; waits for its lifecycle services unless autostart is set."""

    def __init__(self, bench, port, autostart=False):
        self.bench, self.space, self.begun = bench, bench.fresh('driver'), time.monotonic()
        self.heard = bench.ear.hear(PsdVoltages, f'{self.space}/voltages')
        self.events = bench.ear.hear(TransitionEvent, f'{self.space}/psd_node/transition_event', 20)
        self.process = bench.zygote.start('tactile_driver.nodes.psd_node', self.space, source='device', device=port,
                                          autostart=str(autostart).lower())

    def bring_to(self, state):
        client = self.bench.ear.node.create_client(ChangeState, f'{self.space}/psd_node/change_state')
        assert client.wait_for_service(timeout_sec=20.0), self.process.log
        for transition in STATES[state]:
            request = ChangeState.Request()
            request.transition.id = transition
            future, seen = client.call_async(request), len(self.events)
            # The middleware may lose an answer to somebody whom the server has only just met.
            self.bench.until(lambda: future.done() or any(h.message.goal_state.label == AFTER[transition] for h in self.events[seen:]))
            assert not future.done() or future.result().success, self.process.log


ALL = [pytest.param(number, list(STATES), marks=[] if number == signal.SIGTERM else [pytest.mark.slow], id=number.name) for number in CODES]
RUNNING = [pytest.param(number, ['active'], id=f'{number.name} while active') for number in CODES if number != signal.SIGTERM]


@pytest.mark.parametrize(('number', 'states'), ALL + RUNNING)
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
