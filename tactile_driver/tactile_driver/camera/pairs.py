# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras as one source of pairs, paired by stamps."""
from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Mapping

import numpy as np

from ..errors import BadRecording, DeviceLost
from ..frame import CameraCalibration, Frame, PairFrame
from ..sources.capture import Capture, CaptureStatus, FrameQueue
from ..sources.constants import SOURCES
from ..sources.source import NS, EndOfSource, NothingYet, Source
from .constants import CAMERA

LEFT, RIGHT = 0, 1


class Pairer:
    """Pairs each frame with the nearest one of the other camera, at most max_skew_ns, ns, and half a frame period away.

    max_skew_ns: negative for half a period. At a skew beyond half a period an adjacent frame would match better, and that frame may be late
    or lost. So no pair is formed before the period is known. Near half a period, jitter would pair a frame sometimes with the one before
    and sometimes with the one after it; a hysteresis keeps the order of the last pair. nominal_ns: period reported by the cameras, ns, None
    if unknown; the period is measured as well. unpaired: number of frames without a counterpart or out of order.
    """

    def __init__(self, max_skew_ns: int, nominal_ns: float | None = None):
        self.unpaired = 0
        self._max_skew, self._nominal = max_skew_ns if max_skew_ns >= 0 else np.inf, nominal_ns
        self._skews: deque[int] = deque(maxlen=CAMERA.skews)  # ns, of the latest nearest frames, also beyond max_skew
        self._queues: tuple[deque[Frame], deque[Frame]] = deque(), deque()
        self._intervals = deque(maxlen=CAMERA.intervals), deque(maxlen=CAMERA.intervals)
        self._last: list[int | None] = [None, None]

    def add(self, side: int, frame: Frame) -> None:
        """Add the next frame of one camera (0 left, 1 right). A stamp that goes back by over a second restarts the pairing."""
        last = self._last[side]
        if last is not None and frame.stamp_ns <= last:
            if last - frame.stamp_ns < CAMERA.restart_ns:
                self.unpaired += 1
                return
            self.clear()
            self._last = [None, None]
        elif last is not None:
            self._intervals[side].append(frame.stamp_ns - last)
        self._last[side] = frame.stamp_ns
        self._queues[side].append(frame)
        if len(self._queues[side]) > CAMERA.max_waiting_frames:
            self._drop(side)

    def waiting(self, side: int) -> int:
        """Number of frames of one camera that wait for their counterparts."""
        return len(self._queues[side])

    def take(self, last: bool = False) -> PairFrame | None:
        """The next pair, or None; last: no more frames will arrive, so do not wait for the period."""
        left, right = self._queues
        known = last or bool(self._nominal) or max(map(len, self._intervals)) >= CAMERA.min_intervals
        while left and right and known:
            skew = right[0].stamp_ns - left[0].stamp_ns
            if self._are_nearest(skew):
                if self._skews and abs(skew - self._skews[-1]) > (self.period_ns or np.inf) / 2:
                    self._skews.clear()  # from here on other frames form the pairs
                self._skews.append(skew)
                if abs(skew) <= self._max_skew:
                    return PairFrame(left[0], right.popleft(), left.popleft().truth)
            self._drop(LEFT if skew > 0 else RIGHT)
        return None

    def _are_nearest(self, skew: int) -> bool:
        """Whether no adjacent frame matches better than one with this skew, ns."""
        period = self.period_ns
        last = self._skews[-1] if self._skews else 0
        return period is None or abs(skew - np.sign(last) * CAMERA.hysteresis * period) <= period / 2

    @property
    def offset_ms(self) -> float:
        """Median offset of the latest nearest frames, ms, positive where the right camera is later; NaN before there are enough."""
        return 1e-6 * float(np.median(self._skews)) if len(self._skews) >= CAMERA.min_skews else math.nan

    @property
    def warning(self) -> str:
        """Warning of an offset beyond max_skew_ns; '' for none."""
        if not abs(self.offset_ms) > 1e-6 * self._max_skew:
            return ''
        return (f'the exposures of the two cameras are {abs(self.offset_ms):.1f} ms apart, but max_skew is {1e-6 * self._max_skew:.1f} ms: '
                'no image_raw; set max_skew to -1 (half a frame period), or trigger the cameras')

    def take_single(self, side: int) -> PairFrame | None:
        """The next frame of one camera as an incomplete pair, or None; used while the other camera is lost."""
        if not self._queues[side]:
            return None
        frame = self._queues[side].popleft()
        return PairFrame(frame, None) if side == LEFT else PairFrame(None, frame)

    def discard(self) -> None:
        """Discard the waiting frames without counting them as unpaired: they are not wanted."""
        for queue in self._queues:
            queue.clear()

    def clear(self) -> None:
        """Discard the waiting frames and count them as unpaired."""
        for side in (LEFT, RIGHT):
            while self._queues[side]:
                self._drop(side)

    @property
    def period_ns(self) -> float | None:
        """Frame period, ns: the shortest of the nominal and the measured periods; None if unknown."""
        seen = [float(np.percentile(intervals, CAMERA.period_percentile)) for intervals in self._intervals if intervals]
        return min([*seen, *([self._nominal] if self._nominal else [])], default=None)

    def _drop(self, side: int) -> None:
        self._queues[side].popleft()
        self.unpaired += 1


NAMES = ('left', 'right')


class PairedSource(Source):
    """Two sources of one kind, each read in its own thread; frames are paired by stamps.

    left, right: not yet open; max_skew: largest stamp difference of a pair, s, negative for half a frame period (see Pairer). If one of
    two live cameras is lost or silent, read returns incomplete pairs of the other one and warning reports it; the lost camera is reopened
    automatically.
    """

    def __init__(self, left: Source, right: Source, max_skew: float):
        self.live, self.on_demand = left.live, left.on_demand
        self._sources = left, right
        self._max_skew = int(max_skew * NS)
        self._pairer = Pairer(self._max_skew)
        self._captures: list[Capture] = []
        self._changed = threading.Condition()
        self._wanted, self._wanted_since = False, 0.0

    def open(self) -> None:
        """Open both. Raises DeviceLost if both devices are missing, BadRecording or BadArgument for an unusable recording."""
        self.close()
        lost = []
        try:
            for source in self._sources:
                lost.append('')
                try:
                    source.open()
                except DeviceLost as error:
                    lost[-1] = str(error)
            if all(lost):
                raise DeviceLost(_listed(lost))
        except Exception:
            self.close()
            raise
        rates = [about['rate'] for about in (source.describe() for source in self._sources) if self.live and about.get('rate', 0) > 0]
        self._pairer = Pairer(self._max_skew, min((NS / rate for rate in rates), default=None))
        self._captures = [Capture(source, lambda: self._wanted, lambda *_: None, FrameQueue(1, self._changed), text)
                          for source, text in zip(self._sources, lost)]
        for capture in self._captures:
            capture.resume()

    def read(self, wanted: bool = True) -> PairFrame | None:
        """The next pair; None if not wanted, after a frame of either source. Raises EndOfSource when one recording is over, DeviceLost if
        both cameras are lost, NothingYet when none arrives in time, and BadRecording when one of the two cannot be read."""
        if wanted and not self._wanted:
            self._wanted_since = time.monotonic()
        self._wanted = wanted
        before, end = self._received, time.monotonic() + CAMERA.max_read_s
        while True:
            states = [capture.status for capture in self._captures]  # first: no frame comes after an end
            self._fetch()
            over = [state.state == 'ended' and not capture.ready for state, capture in zip(states, self._captures)]
            if not wanted:
                self._pairer.discard()
                if self._received > before:
                    return None
            found = self._pairer.take(last=any(over)) or self._single(states)
            if found is not None:
                return found
            self._check(states, over)
            with self._changed:
                left = end - time.monotonic()
                if left <= 0:
                    raise NothingYet
                if not any(self._captures[side].ready for side in self._needed()):
                    self._changed.wait(left)

    @property
    def _received(self) -> int:
        return sum(capture.status.received for capture in self._captures)

    def _fetch(self) -> None:
        """Pass received frames to the pairer."""
        for side in self._needed():
            frame = self._captures[side].take(0) if self._captures[side].ready else None
            if frame is not None:
                self._pairer.add(side, frame)

    def _needed(self) -> list[int]:
        """The sides to fetch from; of recordings only the one that the pairer needs next, so that neither runs ahead."""
        return [side for side in (LEFT, RIGHT) if self.live or not self._pairer.waiting(side)] or [LEFT, RIGHT]

    def _single(self, states: list[CaptureStatus]) -> PairFrame | None:
        """The next frame of one camera while the other is absent."""
        absent = [self._absent(state) for state in states]
        return self._pairer.take_single(LEFT if absent[RIGHT] else RIGHT) if any(absent) and not all(absent) else None

    def _absent(self, state: CaptureStatus) -> bool:
        """Whether a camera is lost, or silent for several frame periods."""
        if not self.live or not self._wanted:
            return state.state == 'lost'
        period, waited = (self._pairer.period_ns or 0) / NS, time.monotonic() - self._wanted_since
        age = waited if math.isnan(state.age_s) else min(state.age_s, waited)
        return state.state == 'lost' or age > max(SOURCES.min_silence_s, SOURCES.max_silent_periods * period)

    def _check(self, states: list[CaptureStatus], over: list[bool]) -> None:
        """Raise the error that prevents further pairs, if any."""
        if any(over[side] and not self._pairer.waiting(side) for side in (LEFT, RIGHT)):
            self._pairer.clear()
            raise EndOfSource('the recording is over: ' + ', '.join(f'{state.received} {name}' for name, state in zip(NAMES, states)))
        for name, state in zip(NAMES, states):
            if state.state == 'failed':
                raise BadRecording(f'{name}: {state.error}')
        if all(state.state == 'lost' for state in states):
            raise DeviceLost(_listed([state.error for state in states]))

    def set_controls(self, values: Mapping[str, float]) -> None:
        """See Source."""
        for source in self._sources:
            source.set_controls(values)

    def close(self) -> None:
        """Close both."""
        captures, self._captures = self._captures, []
        for capture in captures:
            capture.stop()
        for source in self._sources:
            source.close()

    @property
    def skipped(self) -> int:
        """Number of frames of both cameras that were unpaired or dropped."""
        return self._pairer.unpaired + sum(capture.status.dropped for capture in self._captures)

    @property
    def corrupt(self) -> int:
        """Number of unusable frames of both cameras."""
        return sum(capture.status.corrupt for capture in self._captures)

    @property
    def warning(self) -> str:
        """Warnings about missing cameras and faulty images, '' without any."""
        reported = (self._reported(*camera) for camera in zip(NAMES, self._captures, self._sources))
        return '; '.join(text for text in (*reported, self._pairer.warning) if text)

    @property
    def note(self) -> str:
        """See Source."""
        return '; '.join(source.note for source in self._sources if source.note)

    def _reported(self, name: str, capture: Capture, source: Source) -> str:
        """Warning about one camera, '' without one."""
        state = capture.status
        if self._absent(state):
            return f'no {name} camera, its half is black: ' + (state.error if state.state == 'lost' else 'it sends no frames')
        return f'{name} camera: {source.warning}' if source.warning else ''

    @property
    def truths(self) -> tuple[str, ...]:
        """See Source; that of the left frames."""
        return self._sources[LEFT].truths

    def describe(self) -> dict:
        """Both sources, the rate, Hz, the number of unpaired frames and the offset of the exposures; lost, missed: the number of messages
        lost, and published before the first one arrived (topics only); idle: whether neither source is read at present; recorded: the
        description of the sensor in a recording."""
        left, right = (source.describe() for source in self._sources)
        recorded, _ = ({'recorded': about.pop('recorded')} if 'recorded' in about else {} for about in (left, right))
        paths = ' + '.join(str(about.get('path') or about.get('device') or about.get('topic')) for about in (left, right))
        serial = ' + '.join(str(about.get('serial') or '') for about in (left, right)).strip(' +')
        lost = {name: left[name] + right[name] for name in ('lost', 'missed') if name in left}
        return {'path': paths, 'serial': serial, 'rate': left.get('rate', -1.0), 'left': left, 'right': right,
                'unpaired': self._pairer.unpaired, 'idle': bool(left.get('idle') and right.get('idle')), **lost, **recorded,
                'shutter offset (ms)': self._pairer.offset_ms}

    def calibrations(self) -> tuple[CameraCalibration | None, ...]:
        """Calibrations of both cameras, None where unknown."""
        return tuple(source.calibrations()[0] for source in self._sources)


def _listed(errors: list[str]) -> str:
    return '; '.join(f'{name}: {text}' for name, text in zip(NAMES, errors))
