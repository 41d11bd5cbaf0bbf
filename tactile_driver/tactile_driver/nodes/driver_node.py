# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the lifecycle nodes of all drivers share: configure opens a source, activate publishes what comes from it."""
from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher

from ..errors import BadArgument, DeviceLost, TactileError
from ..parameters.table import Parameter
from .runtime.diagnostics import Health, NodeDiagnostics, LogOnce
from .runtime.host import Host, SharedPublisher
from .runtime.defect_guard import guard_services
from .runtime.parameter_server import NodeParameters
from .runtime.ros_defaults import steady_timer
from ..sources.base.capture import Backoff
from .streams.base import BaseStream
from .streams.camera_health import unconfigured_health

_SUPERVISION_S = 0.1


class DriverNode(LifecycleNode):
    """configure opens the source, activate publishes, deactivate holds, cleanup closes; with autostart it does the first two by itself.

    What it was given at the start and cannot use ends the process then (the timer raises a TactileError); a device that is missing is
    waited for, and what is changed later and wrong is reported.

    name: of the node; table: its parameters; live: names of those that can be changed while it runs; open_stream: makes the running stream
    of the parameters' values, with an open source. Raises TactileError where it cannot. kind: of hardware, in /diagnostics. host: of the
    process.
    """

    def __init__(self, name: str, table: Sequence[Parameter], live: frozenset, open_stream: Callable[[dict], BaseStream],
                 kind: str = 'camera', host: Host | None = None):
        self._host = host or Host()
        super().__init__(name, **self._host.options)
        self._open_stream, self._live = open_stream, live
        self._stream: BaseStream | None = None
        self._problem = ''
        self._backoff = Backoff()
        self._next_try = 0.0
        self._tried, self._refusal = False, None
        self._say = LogOnce(self)
        self._settings = NodeParameters(self, table, self._check_change, self._apply_change)
        self._diagnostics = NodeDiagnostics(self, kind, 'none', self._examine)
        self._supervision = steady_timer(self, _SUPERVISION_S, self._supervise)
        guard_services(self)

    def create_lifecycle_publisher(self, *args, **kwargs) -> Publisher | SharedPublisher:
        """As of a lifecycle node, with takers in the process."""
        return self._host.publisher(super().create_lifecycle_publisher(*args, **kwargs))

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the source; FAILURE where it is missing or a parameter is wrong: the node stays unconfigured and says why."""
        try:
            self._stream = self._opened_stream()
        except DeviceLost as error:
            self._refuse(str(error), time.monotonic() + self._backoff.next())
            return TransitionCallbackReturn.FAILURE
        except TactileError as error:
            self._refusal = error
            self._refuse(str(error), math.inf)
            return TransitionCallbackReturn.FAILURE
        except Exception as error:  # rclpy would swallow it
            if self.context.ok():  # else it is because ROS ends
                self._refuse(f'configure failed: {error!r}', math.inf)
            return TransitionCallbackReturn.ERROR
        if self._problem:
            self._say.forget(self._problem)
        self._problem = ''
        self._backoff.reset()
        about = self._stream.source.describe()
        self._diagnostics.set_hardware_id(str(about.get('serial') or about.get('by_id') or about.get('path') or about.get('device')))
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Publish."""
        result = super().on_activate(state)
        self._stream.resume()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Hold."""
        self._stream.pause()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the source."""
        self._close()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the source for good."""
        self._supervision.cancel()
        self._close()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Back to unconfigured, with nothing left open."""
        self._close()
        return TransitionCallbackReturn.SUCCESS

    def destroy_node(self) -> None:
        """Close the source and end its threads first."""
        self._close()
        super().destroy_node()

    def _opened_stream(self) -> BaseStream:
        if self._settings.problems:
            raise BadArgument('; '.join(self._settings.problems.values()) + '; set it right with ros2 param set, or start again')
        return self._open_stream(self._settings.values())

    def now_ns(self) -> int:
        """The node's clock, ns."""
        return self.get_clock().now().nanoseconds

    def _close(self) -> None:
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.stop()

    def _refuse(self, problem: str, next_try: float) -> None:
        self._problem, self._next_try = problem, next_try
        if not self._ends:
            self._say.error(problem, problem)

    @property
    def _ends(self) -> bool:
        """Whether what was given at the start cannot be used."""
        return self._refusal is not None and not self._tried and self._settings['autostart']

    def _supervise(self) -> None:
        """Start by itself; again after a while where the device is missing, or when a parameter has changed. Raises TactileError where
        what was given at the start cannot be used."""
        if not self._settings['autostart'] or self._stream is not None:
            self._supervision.cancel()
        elif time.monotonic() >= self._next_try:
            self._next_try = math.inf
            if self.trigger_configure() == TransitionCallbackReturn.SUCCESS:
                self.trigger_activate()
            if self._ends:
                raise self._refusal
            self._tried = True
            self._diagnostics.update()

    def _check_change(self, changes: dict) -> None:
        fixed = sorted(n for n, value in changes.items() if n not in self._live and value != self._settings[n])
        if self._stream is not None and fixed:
            raise BadArgument(f'parameter {fixed[0]} can be changed only while the node is unconfigured: deactivate and clean up first')

    def _apply_change(self, changes: dict) -> None:
        self._next_try = 0.0
        if self._stream is not None:
            self._stream.change(changes)

    def _examine(self) -> Health:
        stream = self._stream
        if stream is None:
            return unconfigured_health(self._problem, math.isfinite(self._next_try) and not self._supervision.is_canceled())
        return stream.health()
