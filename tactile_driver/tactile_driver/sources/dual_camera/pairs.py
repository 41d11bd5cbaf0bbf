# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras as one source of pairs: two sources paired by stamps, or one source with side-by-side images."""
from __future__ import annotations

import math
import threading
import time

from ..base.capture import Capture, CaptureStatus
from ..base.pacing import NS
from ..base.protocol import EndOfSource, NothingYet, Source
from ..base.shutter_offset import ShutterOffset
from ...errors import BadRecording, DeviceLost
from ...frame import CameraCalibration, Frame, PairFrame
from .pairing import LEFT, RIGHT, Pairer

NAMES = ('left', 'right')
Calibrations = tuple[CameraCalibration | None, CameraCalibration | None]
_MOMENT_S = 0.2  # longest wait of one read; chosen
_SILENCE_PERIODS, _SHORTEST_SILENCE = 5, 1.0  # frame periods, and s: a camera silent for longer than both is absent; chosen


class DualSource(Source):
    """A source whose frames are PairFrames.

    shutters: how far apart the two cameras expose; None where each pair has one stamp.
    """

    shutters: ShutterOffset | None = None

    def calibrations(self) -> Calibrations:
        """Calibrations of the left and the right camera, None where unknown; valid once open."""
        return None, None


class PairedSource(DualSource):
    """Two sources of one kind, each read in its own thread; frames are paired by stamps.

    left, right: not yet open; max_skew: largest stamp difference of a pair, s, negative for half a frame period (see Pairer). If one of
    two live cameras is lost or silent, read returns incomplete pairs of the other one and remark reports it; the lost camera is reopened
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
        lost = [self._open_one(source) for source in self._sources]
        if all(lost):
            self.close()
            raise DeviceLost('; '.join(f'{name}: {text}' for name, text in zip(NAMES, lost)))
        rates = [about['rate'] for about in (source.describe() for source in self._sources) if self.live and about.get('rate', 0) > 0]
        self._pairer = Pairer(self._max_skew, min((NS / rate for rate in rates), default=None))
        self._captures = [Capture(source, lambda: self._wanted, lambda *_: None, changed=self._changed, lost=text)
                          for source, text in zip(self._sources, lost)]
        for capture in self._captures:
            capture.resume()

    def _open_one(self, source: Source) -> str:
        """Open one source. Returns '', or the reason why its device is missing."""
        try:
            source.open()
        except DeviceLost as error:
            return str(error)
        except Exception:
            self.close()
            raise
        return ''

    def read(self, wanted: bool = True) -> PairFrame | None:
        """The next pair; None if not wanted. Raises EndOfSource when one recording is over, DeviceLost when both cameras are lost,
        NothingYet when none arrives within _MOMENT_S, and BadRecording when one of the two is no longer readable."""
        if wanted and not self._wanted:
            self._wanted_since = time.monotonic()
        self._wanted = wanted
        if not wanted:
            return self._pass_over()
        end = time.monotonic() + _MOMENT_S
        while True:
            states = [capture.status for capture in self._captures]
            self._fetch()
            found = self._next(states)
            if found is not None:
                return found
            self._check(states)
            left = end - time.monotonic()
            if left <= 0:
                raise NothingYet
            with self._changed:
                self._changed.wait_for(lambda: any(capture.ready for capture in self._captures), left)

    def _fetch(self) -> None:
        """Pass received frames to the pairer; of recordings only the side it needs next, so that neither runs ahead."""
        needed = [side for side in (LEFT, RIGHT) if self.live or not self._pairer.waiting(side)] or [LEFT, RIGHT]
        for side in needed:
            frame = self._captures[side].take(0) if self._captures[side].ready else None
            if frame is not None:
                self._pairer.add(side, frame)

    def _next(self, states: list[CaptureStatus]) -> PairFrame | None:
        found = self._pairer.take(last=any(self._over(side, states[side]) for side in (LEFT, RIGHT)))
        absent = [self._absent(state) for state in states]
        if found is None and any(absent) and not all(absent):
            found = self._pairer.take_single(LEFT if absent[RIGHT] else RIGHT)
        return found

    def _over(self, side: int, state: CaptureStatus) -> bool:
        """Whether this source has ended and all its frames are consumed."""
        return state.state == 'ended' and not self._captures[side].ready

    def _absent(self, state: CaptureStatus) -> bool:
        """Whether a camera is lost, or silent for several frame periods."""
        if not self.live or not self._wanted:
            return state.state == 'lost'
        period, waited = (self._pairer.period_ns or 0) / NS, time.monotonic() - self._wanted_since
        age = waited if math.isnan(state.age_s) else min(state.age_s, waited)
        return state.state == 'lost' or age > max(_SHORTEST_SILENCE, _SILENCE_PERIODS * period)

    def _check(self, states: list[CaptureStatus]) -> None:
        """Raise the error that prevents further pairs, if any."""
        if any(self._over(side, states[side]) and not self._pairer.waiting(side) for side in (LEFT, RIGHT)):
            self._pairer.clear()
            raise EndOfSource('the recording is over: ' + ', '.join(f'{state.received} {name}' for name, state in zip(NAMES, states)))
        for name, state in zip(NAMES, states):
            if state.state == 'failed':
                raise BadRecording(f'{name}: {state.error}')
        if all(state.state == 'lost' for state in states):
            raise DeviceLost('; '.join(f'{name}: {state.error}' for name, state in zip(NAMES, states)))

    def _pass_over(self) -> None:
        """Wait for an unwanted frame of either source and discard it. Raises NothingYet after _MOMENT_S."""
        self._pairer.forget()
        before = [capture.status.received for capture in self._captures]
        end = time.monotonic() + _MOMENT_S
        while time.monotonic() < end:
            states = [capture.status for capture in self._captures]
            for capture in self._captures:
                capture.take(0)
            if any(state.received > count for state, count in zip(states, before)):
                return
            self._check(states)
            time.sleep(0.005)
        raise NothingYet

    def set_exposure(self, exposure: float) -> None:
        """See Source."""
        for source in self._sources:
            source.set_exposure(exposure)

    def close(self) -> None:
        """Close both."""
        captures, self._captures = self._captures, []
        for capture in captures:
            capture.stop()
        if not captures:
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
    def remark(self) -> str:
        """Warnings about missing cameras and faulty images, '' without any."""
        told = (self._told(*camera) for camera in zip(NAMES, self._captures, self._sources))
        return '; '.join(text for text in (*told, self.shutters.remark) if text)

    @property
    def shutters(self) -> ShutterOffset:
        """See DualSource."""
        return self._pairer.shutters

    @property
    def truths(self) -> tuple[str, ...]:
        """See Source; that of the left frames."""
        return self._sources[LEFT].truths

    def _told(self, name: str, capture: Capture, source: Source) -> str:
        """Warning about one camera, '' without one."""
        state = capture.status
        if self._absent(state):
            return f'no {name} camera, its half is black: ' + (state.error if state.state == 'lost' else 'it sends no frames')
        return f'{name} camera: {source.remark}' if source.remark else ''

    def describe(self) -> dict:
        """Both sources, the rate, Hz, the number of unpaired frames, lost: the number of lost messages (topics only), idle: whether
        neither source is read at present, and recorded: the description of the sensor in a recording."""
        left, right = (source.describe() for source in self._sources)
        recorded, _ = ({'recorded': about.pop('recorded')} if 'recorded' in about else {} for about in (left, right))
        place = ' + '.join(str(about.get('path') or about.get('device') or about.get('topic')) for about in (left, right))
        serial = ' + '.join(str(about.get('serial') or '') for about in (left, right)).strip(' +')
        lost = {'lost': left['lost'] + right['lost']} if 'lost' in left else {}
        return {'source': left['source'], 'path': place, 'serial': serial, 'rate': left.get('rate', -1.0), 'left': left, 'right': right,
                'unpaired': self._pairer.unpaired, 'idle': bool(left.get('idle') and right.get('idle')), **lost, **recorded}

    def calibrations(self) -> Calibrations:
        """Calibrations of both cameras, None where unknown."""
        return tuple(source.calibration() for source in self._sources)


class SplitSource(DualSource):
    """One source whose images hold both views side by side, the left view in the left half."""

    def __init__(self, source: Source):
        self.live, self.on_demand, self._source = source.live, source.on_demand, source

    def open(self) -> None:
        """Open the source; raises its errors."""
        self._source.open()

    def read(self, wanted: bool = True) -> PairFrame | None:
        """The next frame split into halves; None if not wanted. Raises the errors of the source."""
        frame = self._source.read(wanted)
        if frame is None:
            return None
        half = frame.image.shape[1] // 2
        return PairFrame(Frame(frame.image[:, :half], frame.stamp_ns, frame.encoding),
                         Frame(frame.image[:, -half:], frame.stamp_ns, frame.encoding), frame.truth)

    def set_exposure(self, exposure: float) -> None:
        """See Source."""
        self._source.set_exposure(exposure)

    def close(self) -> None:
        """Close the source."""
        self._source.close()

    @property
    def skipped(self) -> int:
        """Number of frames that were due but not produced."""
        return self._source.skipped

    @property
    def truths(self) -> tuple[str, ...]:
        """See Source."""
        return self._source.truths

    @property
    def corrupt(self) -> int:
        """Number of unusable frames."""
        return self._source.corrupt

    @property
    def remark(self) -> str:
        """Warning of the source, '' without one."""
        return self._source.remark

    def describe(self) -> dict:
        """The description of the source, with the layout side_by_side."""
        return {**self._source.describe(), 'layout': 'side_by_side'}
