# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all drivers share: a lifecycle node whose stream reads an open source in one thread and publishes in another."""
from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterable, Sequence

import yaml
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from ..errors import BadArgument, DeviceLost, TactileError
from ..parameters.drivers import LIVE, check_together
from ..parameters.table import Parameter
from ..recordings.truth import RecordedTruth
from ..simulation.truth import TruthFrame
from ..sources.capture import Capture, FrameQueue
from ..sources.constants import SOURCES
from ..sources.registry import Sources, make_source
from ..sources.source import Source
from .constants import NODES
from .health import COUNTS, capture_health, unconfigured_health
from .messages.conversions import header_of
from .messages.ground_truth import GroundTruth
from .runtime.defect_guard import guard_services
from .runtime.diagnostics import Health, LogOnce, NodeDiagnostics
from .runtime.host import Host, SharedPublisher
from .runtime.parameter_server import NodeParameters
from .runtime.ros_defaults import LATCHED_QOS, STREAM_QOS, steady_timer

_AND_MORE = 'there were more such problems; they are left out until the node is configured again'
#: longest time that a recording with rate 0 waits for its subscribers' acknowledgement
_ACKNOWLEDGE = Duration(seconds=1)


class Stream:
    """Read an open source in one thread and publish in another.

    Parameters
    ----------
    node : DriverNode
        Its `publish` is called with each frame.
    source : Source
        An open source, which `stop` closes.
    values : dict
        The node's parameters.

    Attributes
    ----------
    warnings : list of str
        Warnings about the data, shown on /diagnostics.
    capture : Capture
        Reads the source, and can be paused.
    over : bool
        Whether the recording has ended and its last frame is published.
    """

    def __init__(self, node: DriverNode, source: Source, values: dict):
        self._node, self.source, self.values = node, source, values
        self._log = LogOnce(node)
        self.warnings: list[str] = []
        self._known: dict = {}
        self._described = ''
        self._stopped = self.over = False
        node.truth.offer(source.truths)
        self.describe()
        self.capture = Capture(source, self._subscribers, self._report, FrameQueue(node.keep), settle=NODES.settle_s)
        self._thread = threading.Thread(target=self._run, name='publish', daemon=True)
        self._thread.start()

    @property
    def about(self) -> dict:
        """The source's name and description."""
        return {'source': self.values['source'], **self.source.describe()}

    def describe(self, **known) -> None:
        """Publish the description of the sensor if it changed.

        Parameters
        ----------
        **known
            What the description has besides that of the source, kept for later calls.
        """
        self._known |= known
        about = {'sensor_type': self.values['sensor_type'], 'frame_id': self.values['frame_id'], **_constant(self.about), **self._known}
        text = yaml.safe_dump(about, sort_keys=False)
        if text != self._described:
            self._described = text
            self._node.description.publish(String(data=text))

    def warn(self, text: str) -> None:
        """Log a warning about the data once, and report it on /diagnostics from now on.

        Parameters
        ----------
        text : str
            The warning; '' for none.
        """
        if len(self.warnings) >= NODES.max_warnings:
            text = _AND_MORE
        if text and text not in self.warnings:
            self.warnings.append(text)
            self._log.warning(text, text)

    def health(self, meter=None) -> Health:
        """Return what /diagnostics shows; meter is that of capture_health."""
        if self.source.note:
            self._node.get_logger().info(self.source.note, once=True)
        warning = '; '.join(text for text in (self.source.warning, *self.warnings) if text)
        return capture_health(self.capture.status, self.about, self.source.live, warning, meter)

    def stop(self) -> None:
        """End the threads and close the source."""
        self._stopped = True
        self.capture.stop()
        self._thread.join(timeout=5.0)

    def _subscribers(self) -> int:
        try:
            return self._node.subscribers
        except RuntimeError:  # ROS may shut down before this thread ends
            if self._node.context.ok():
                raise
            return 0

    @property
    def waited_s(self) -> float:
        """How long the present frame has waited, s; 0 for a recording, of which no frame is skipped."""
        return self.capture.waited_s if self.source.live else 0.0

    def _report(self, level: str, text: str) -> None:
        if level == 'error':
            self._node.get_logger().error(text)
        else:
            self._node.get_logger().info(text)
            self.describe()

    def _run(self) -> None:
        while not self._stopped:
            ended = self.capture.ended  # asked first: no frame comes after it
            frame = self.capture.take(NODES.take_s)
            if frame is None:
                self.over = ended
                continue
            try:
                self._node.publish(self, frame)
                if self.source.on_demand:
                    for publisher in self._node.streams:
                        publisher.wait_for_all_acked(_ACKNOWLEDGE)
            except Exception as error:  # the thread must survive a frame that cannot be published
                if not self._node.context.ok():
                    return
                self._log.error('publish', f'a frame could not be published: {error!r}; the next one is tried')


def _constant(about: dict) -> dict:
    """Return what of a source's description does not change while it runs."""
    return {name: _constant(value) if isinstance(value, dict) else value for name, value in about.items()
            if name not in COUNTS and name != 'idle'}


class DriverNode(LifecycleNode):
    """A lifecycle node that publishes what a source reads. Subclasses set `raw`, and define `open_source` and `publish`.

    Its transition configure opens the source, activate publishes, deactivate pauses, and cleanup closes the source; with the parameter
    `autostart` the node does the first two itself.

    Parameters
    ----------
    name : str
        Name of the node.
    table : sequence of Parameter
        Its parameters.
    kind : str
        Kind of hardware, shown on /diagnostics.
    host : Host, optional
        What the nodes of one process share.

    Attributes
    ----------
    keep : int
        Number of newest frames of a live source that wait to be published.
    raw : list of SharedPublisher
        Publishers of the raw data.

    Notes
    -----
    A start parameter that cannot be used ends the process: the supervision timer raises a TactileError. The node waits for a missing
    device, and reports a wrong parameter that was set later.
    """

    keep = 1

    def __init__(self, name: str, table: Sequence[Parameter], kind: str, host: Host | None = None):
        self._host = host or Host()
        super().__init__(name, **self._host.options)
        self._stream: Stream | None = None
        self._problem = ''
        self._next_try = 0.0
        self._tried, self._refusal = False, None
        self._log = LogOnce(self)
        self._settings = NodeParameters(self, table, self._check_change, self._apply_change)
        self.raw: list[SharedPublisher] = []
        self.description, self.truth = self.create_publisher(String, 'description', LATCHED_QOS), GroundTruth(self)
        self._diagnostics = NodeDiagnostics(self, kind, 'none', self._examine)
        self._supervision = steady_timer(self, NODES.supervision_s, self._supervise)
        self._over_s: float | None = None  # monotonic s since which the recording is over
        self._end = steady_timer(self, NODES.supervision_s, self._follow_recording)  # of recordings only: each call wakes the executor
        self._end.cancel()
        guard_services(self)

    def open_source(self, values: dict) -> Source:
        """Open the source that the parameters name.

        Parameters
        ----------
        values : dict
            The node's parameters.

        Returns
        -------
        Source
            The open source.

        Raises
        ------
        TactileError
            If it cannot be opened; DeviceLost if its device is missing.
        """
        raise NotImplementedError

    def opened(self, sources: Sources, values: dict) -> Source:
        """Open the one of some sources that the parameter `source` names.

        Parameters
        ----------
        sources : Sources
            A table of sources.
        values : dict
            The node's parameters.

        Returns
        -------
        Source
            The open source.

        Raises
        ------
        TactileError
            If the parameters contradict each other, or it cannot be opened.
        """
        check_together(values)
        source = make_source(sources, values | {'simulated_time': self.get_parameter('use_sim_time').value}, self.now_ns)
        source.open()
        return source

    def publish(self, stream: Stream, frame) -> None:
        """Publish a frame of the stream. It is called in the stream's thread."""
        raise NotImplementedError

    def publish_truth(self, stream: Stream, truth: TruthFrame | RecordedTruth | None, stamp_ns: int) -> None:
        """Publish the ground truth of an image with this stamp."""
        frame_id = stream.values['frame_id']
        if isinstance(truth, RecordedTruth):
            self.truth.publish_recorded(truth, frame_id)
        elif truth is not None:
            self.truth.publish(truth, 1 / stream.source.describe()['rate'], header_of(stamp_ns, frame_id))

    @property
    def subscribers(self) -> int:
        """Number of subscriptions to the raw data and the ground truth."""
        return sum(publisher.get_subscription_count() for publisher in self.raw) + self.truth.subscribers

    def health(self, stream: Stream) -> Health:
        """Return what /diagnostics shows."""
        return stream.health()

    def create_lifecycle_publisher(self, *args, **kwargs) -> SharedPublisher:
        """Make a lifecycle publisher that nodes of the same process may attach to."""
        return self._host.publisher(super().create_lifecycle_publisher(*args, **kwargs))

    @property
    def streams(self) -> Iterable[SharedPublisher]:
        """The publishers of the raw data, and of what the nodes of this process compute from them."""
        return self._host.publishers or self.raw

    @property
    def raw_qos(self) -> QoSProfile:
        """Quality of service of raw data, of which `keep` messages may wait for a subscriber.

        A recording of rate 0 waits until each message is acknowledged. Fast DDS asks for that at once if its history is full, else only
        every 3 s: the depth is 1.
        """
        return STREAM_QOS if self._settings['rate'] == 0 else QoSProfile(depth=self.keep)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the source.

        Returns
        -------
        TransitionCallbackReturn
            FAILURE if the source is missing or a parameter is wrong: the node stays unconfigured and reports why.
        """
        try:
            if self._settings.problems:
                raise BadArgument('; '.join(self._settings.problems.values()) + '; correct it with ros2 param set, or start again')
            values = self._settings.values()
            self._stream = Stream(self, self.open_source(values), values)
            if not self._stream.source.live:
                self._end.reset()
        except DeviceLost as error:
            self._refuse(str(error), time.monotonic() + SOURCES.retry_s)
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
            self._log.reset(self._problem)
        self._problem = ''
        about = self._stream.source.describe()
        self._diagnostics.hardware_id = str(about.get('serial') or about.get('by_id') or about.get('path') or about.get('device'))
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start to publish."""
        result = super().on_activate(state)
        self._stream.capture.resume()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Pause."""
        self._stream.capture.pause()
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
        """Configure and activate with autostart; retry after a missing device or a changed parameter.

        Raises
        ------
        TactileError
            If a start parameter cannot be used.
        """
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

    def _follow_recording(self) -> None:
        """Say on /diagnostics that the recording is over; end the process after it unless parameter stay is set."""
        if self._stream is None:
            self._over_s = None
            self._end.cancel()
        elif not self._stream.over:
            self._over_s = None
        elif self._over_s is None:
            self._over_s = time.monotonic()
            self._diagnostics.update()
        elif not self._settings['stay'] and time.monotonic() - self._over_s > NODES.farewell_s:
            raise KeyboardInterrupt  # ends run_nodes as Ctrl-C does

    def _check_change(self, changes: dict) -> None:
        fixed = sorted(name for name, value in changes.items() if name not in LIVE and value != self._settings[name])
        if self._stream is not None and fixed:
            raise BadArgument(f'parameter {fixed[0]} can be changed only while the node is unconfigured: deactivate and clean up first')

    def _apply_change(self, changes: dict) -> None:
        self._next_try = 0.0
        if self._stream is not None:
            self._stream.source.set_controls({name: value for name, value in changes.items() if name in LIVE})

    def _examine(self) -> Health:
        stream = self._stream
        if stream is None:
            return unconfigured_health(self._problem, math.isfinite(self._next_try) and not self._supervision.is_canceled())
        return self.health(stream)
