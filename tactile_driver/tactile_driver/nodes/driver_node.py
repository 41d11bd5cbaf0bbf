# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The lifecycle node that all drivers share: configure opens a source, activate publishes its data."""
from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher

from ..errors import BadArgument, DeviceLost, TactileError
from ..parameters.shared import LIVE, check_together
from ..parameters.table import Parameter
from .runtime.defect_guard import guard_services
from .runtime.diagnostics import Health, LogOnce, NodeDiagnostics
from .runtime.host import Host, SharedPublisher
from .runtime.parameter_server import NodeParameters
from .runtime.ros_defaults import steady_timer
from ..sources.base.capture import Backoff
from ..sources.base.protocol import Clock, Source
from .streams.base import BaseStream
from .health import unconfigured_health

_SUPERVISION_S = 0.1  # chosen: a device that is plugged in again is open within a frame or two of a slow camera


class DriverNode(LifecycleNode):
    """configure opens the source, activate publishes, deactivate pauses, cleanup closes; with autostart the node does the first two itself.

    A start parameter that cannot be used ends the process (the supervision timer raises a TactileError). The node waits for a missing
    device, and reports a wrong parameter that was set later.

    name: of the node; table: its parameters; kind: of hardware, shown in /diagnostics; host: of the process.
    """

    def __init__(self, name: str, table: Sequence[Parameter], kind: str, host: Host | None = None):
        self._host = host or Host()
        super().__init__(name, **self._host.options)
        self._stream: BaseStream | None = None
        self._problem = ''
        self._backoff = Backoff()
        self._next_try = 0.0
        self._tried, self._refusal = False, None
        self._log = LogOnce(self)
        self._settings = NodeParameters(self, table, self._check_change, self._apply_change)
        self._diagnostics = NodeDiagnostics(self, kind, 'none', self._examine)
        self._supervision = steady_timer(self, _SUPERVISION_S, self._supervise)
        guard_services(self)

    def open_stream(self, values: dict) -> BaseStream:
        """A running stream for the parameters' values, with an open source. Raises TactileError if it cannot be opened."""
        raise NotImplementedError

    def opened(self, make_source: Callable[[Mapping, Clock], Source], values: dict) -> Source:
        """The source for the parameters' values, open. Raises TactileError."""
        check_together(values)
        source = make_source(values, self.now_ns)
        source.open()
        return source

    def create_lifecycle_publisher(self, *args, **kwargs) -> Publisher | SharedPublisher:
        """A lifecycle publisher that nodes of the same process may attach to."""
        return self._host.publisher(super().create_lifecycle_publisher(*args, **kwargs))

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the source. FAILURE if it is missing or a parameter is wrong: the node stays unconfigured and reports why."""
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
            if self.context.ok():  # else ROS is shutting down
                self._refuse(f'configure failed: {error!r}', math.inf)
            return TransitionCallbackReturn.ERROR
        if self._problem:
            self._log.forget(self._problem)
        self._problem = ''
        self._backoff.reset()
        about = self._stream.source.describe()
        self._diagnostics.set_hardware_id(str(about.get('serial') or about.get('by_id') or about.get('path') or about.get('device')))
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start to publish."""
        result = super().on_activate(state)
        self._stream.resume()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Pause."""
        self._stream.pause()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the source."""
        self._close()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the source and stop the supervision."""
        self._supervision.cancel()
        self._close()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the source and return to unconfigured."""
        self._close()
        return TransitionCallbackReturn.SUCCESS

    def destroy_node(self) -> None:
        """Close the source and end its threads, then destroy the node."""
        self._close()
        super().destroy_node()

    def _opened_stream(self) -> BaseStream:
        if self._settings.problems:
            raise BadArgument('; '.join(self._settings.problems.values()) + '; correct it with ros2 param set, or start again')
        return self.open_stream(self._settings.values())

    def now_ns(self) -> int:
        """Time of the node's clock, ns."""
        return self.get_clock().now().nanoseconds

    def _close(self) -> None:
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.stop()

    def _refuse(self, problem: str, next_try: float) -> None:
        self._problem, self._next_try = problem, next_try
        if not self._must_end:
            self._log.error(problem, problem)

    @property
    def _must_end(self) -> bool:
        """Whether a start parameter cannot be used."""
        return self._refusal is not None and not self._tried and self._settings['autostart']

    def _supervise(self) -> None:
        """Configure and activate with autostart; retry after a missing device or a changed parameter. Raises TactileError if a start
        parameter cannot be used."""
        if not self._settings['autostart'] or self._stream is not None:
            self._supervision.cancel()
        elif time.monotonic() >= self._next_try:
            self._next_try = math.inf
            if self.trigger_configure() == TransitionCallbackReturn.SUCCESS:
                self.trigger_activate()
            if self._must_end:
                raise self._refusal
            self._tried = True
            self._diagnostics.update()

    def _check_change(self, changes: dict) -> None:
        fixed = sorted(name for name, value in changes.items() if name not in LIVE and value != self._settings[name])
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
