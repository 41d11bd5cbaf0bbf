# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Faults for the hands of hand_soak.py, one after the other, each applied to the next sensor or process that it can affect."""
from __future__ import annotations

import os
import signal
import time
from collections import Counter
from collections.abc import Callable

import psutil
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from std_srvs.srv import Trigger

from hand_live import SENSORS, stamp_in
from soak_system import EMULATORS, System

DRIVERS = {'touchpad': 'camera_node', 'areal_dual': 'dual_camera_node', 'psd_finger': 'psd_node', 'taxel_array': 'taxel_array_node'}
_STOPPED_S = 3.0
_RECORDED_S = 8.0  # s; a busy machine needs the first half to start
_NOT_DEAD_NS = 10**8  # ns: stamps of a killed process may be this much later than the kill, by its clock estimate and batches
_NS = 10**9


class Heard:
    """Of one sensor: how many results came, and [when it was killed, ns; after how many s it was back, None while it is not]."""

    def __init__(self):
        self.count, self.kills = 0, []

    def take(self, data: bytes) -> None:
        """A result as bytes."""
        self.count += 1
        if self.kills and self.kills[-1][1] is None and stamp_in(data) > self.kills[-1][0] + _NOT_DEAD_NS:
            self.kills[-1][1] = (time.time_ns() - self.kills[-1][0]) / _NS


class Faults:
    """Makes them happen. told: of each {fault, target, answer}, where the answer may come later."""

    def __init__(self, system: System, node: Node, heard: dict[str, Heard]):
        self.told: list[dict] = []
        self._system, self._heard, self._turns = system, heard, Counter()
        self._later: list[tuple[float, Callable[[], None]]] = []
        self._references = {name: node.create_client(Trigger, f'/{name}/set_reference') for name in SENSORS}
        self._parameters = {name: node.create_client(SetParameters, f'/{name}/{DRIVERS[kind]}/set_parameters')
                            for name, (kind, *_) in SENSORS.items()}
        self._kinds: dict[str, tuple] = {
            'process killed': (self._kill, SENSORS), 'garbage on the line': (self._typed('garbage'), EMULATORS),
            'subscriber stopped for 3 s': (self._stop, ['subscriber']), 'port unplugged for 1 s': (self._typed('unplug'), EMULATORS),
            'set_reference called': (self._reference, SENSORS), 'frame cut in its middle': (self._typed('drop'), EMULATORS),
            'parameter set to nonsense': (self._nonsense, SENSORS), 'recorded for 8 s': (self._record, EMULATORS),
            'nothing sent for 1 s': (self._typed('pause'), EMULATORS)}

    def happen(self) -> None:
        """The next one."""
        kind = list(self._kinds)[len(self.told) % len(self._kinds)]
        act, targets = self._kinds[kind]
        target = list(targets)[self._turns[kind] % len(targets)]
        self._turns[kind] += 1
        self.told.append({'fault': kind, 'target': target, 'answer': ''})
        act(target, self.told[-1])

    def go_on(self) -> None:
        """Do what is due by now."""
        now = time.monotonic()
        due = [act for at, act in self._later if at <= now]
        self._later = [(at, act) for at, act in self._later if at > now]
        for act in due:
            act()

    def _after(self, seconds: float, act: Callable[[], None]) -> None:
        self._later.append((time.monotonic() + seconds, act))

    def _typed(self, fault: str) -> Callable:
        return lambda target, _told: self._system.type_fault(target, fault)

    def _kill(self, target: str, told: dict) -> None:
        process = self._system.processes().get(target)
        try:
            process and process.kill()
        except psutil.NoSuchProcess:
            process = None
        if process is None:
            told['answer'] = 'was not there'
        else:
            self._heard[target].kills.append([time.time_ns(), None])

    def _stop(self, _target: str, _told: dict) -> None:
        os.kill(self._system.subscriber.pid, signal.SIGSTOP)
        self._after(_STOPPED_S, lambda: os.kill(self._system.subscriber.pid, signal.SIGCONT))

    def _call(self, client, request, told: dict, tell: Callable) -> None:
        """An answer that never comes is not waited for."""
        told['answer'] = 'none'
        future = client.call_async(request)
        future.add_done_callback(lambda done: told.update(answer=tell(done.result())))

    def _reference(self, target: str, told: dict) -> None:
        self._call(self._references[target], Trigger.Request(), told, lambda answer: 'taken' if answer.success else 'refused')

    def _nonsense(self, target: str, told: dict) -> None:
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value='nonsense')
        self._call(self._parameters[target], SetParameters.Request(parameters=[Parameter(name='rate', value=value)]), told,
                   lambda answer: 'accepted' if answer.results[0].successful else 'refused')

    def _record(self, target: str, told: dict) -> None:
        recorder = self._system.record(target, len(self.told))
        told['answer'] = 'still recording'

        def end() -> None:
            if recorder.poll() is None:
                os.killpg(recorder.pid, signal.SIGINT)
            self._after(_RECORDED_S, lambda: told.update(answer=f'exit code {recorder.poll()}'))
        self._after(_RECORDED_S, end)
