# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The /diagnostics of a PSD finger's node, and its sample rate. No ROS but the levels."""
from __future__ import annotations

import math
import time
from collections import deque

import numpy as np

from .camera_health import FEW, left_out_remark
from ..runtime.diagnostics import ERROR, OK, WARN, Health, common_values
from ...sources.base.capture import CaptureStatus

_WINDOW_S, _SILENCE_S = 4.0, 1.0  # span of the rate and the shares; silence that is an error; chosen
_RATE_TOLERANCE, _SATURATED = 0.9, 0.01  # shares of the nominal rate and of saturated samples that give a warning; chosen
_STATES = {'paused': 'ready, not active', 'ended': 'the recording is over; clean up and configure to play it again'}


class SampleMeter:
    """Counts the samples of the last seconds. saturation: V, from which an output is saturated."""

    def __init__(self, saturation: float):
        self._saturation = saturation
        self.samples = self.saturated = 0
        self._recent: deque[tuple[float, int, int]] = deque()  # monotonic s, samples, saturated ones

    def add(self, volts: np.ndarray) -> None:
        """Count samples (N, 4), V."""
        now, high = time.monotonic(), int((volts >= self._saturation).any(axis=1).sum())
        self.samples += len(volts)
        self.saturated += high
        self._recent.append((now, len(volts), high))
        while now - self._recent[0][0] > _WINDOW_S:
            self._recent.popleft()

    def _lately(self) -> list[tuple[float, int, int]]:
        """The entries that are in the window now."""
        now = time.monotonic()
        return [each for each in list(self._recent) if now - each[0] <= _WINDOW_S]

    @property
    def rate(self) -> float:
        """Samples per second over the window; NaN until known."""
        recent = self._lately()
        if len(recent) < 3:
            return math.nan
        seconds = recent[-1][0] - recent[0][0]
        return sum(count for _, count, _ in recent[1:]) / seconds if seconds > 0 else math.nan

    @property
    def saturated_part(self) -> float:
        """Share of saturated samples in the window, 0 to 1."""
        recent = self._lately()
        return sum(high for *_, high in recent) / max(sum(count for _, count, _ in recent), 1)


def sample_health(status: CaptureStatus, about: dict, meter: SampleMeter, live: bool, remark: str) -> Health:
    """The health of a node with an open source. about: the source's description; live: whether it is a device; remark: a warning, ''."""
    extra = {name: about[name] for name in ('crc errors', 'refused frames', 'garbage bytes', 'missing frames', 'missing samples', 'resets')
             if name in about}
    values = {**common_values(status.state, meter.rate, status.age_s, status.dropped), 'source': about.get('source', ''),
              'device': about.get('path') or about.get('device', ''), 'samples': meter.samples,
              'saturated (%)': 100 * meter.saturated_part, 'messages': status.received, **extra, 'last error': status.error}
    return Health(*_judged(status, about, meter, live, remark), values)


def _judged(status: CaptureStatus, about: dict, meter: SampleMeter, live: bool, remark: str) -> tuple[bytes, str]:
    if status.state in ('lost', 'failed'):
        return ERROR, status.error
    if status.state != 'running':
        return OK, _STATES[status.state]
    if live and status.age_s > _SILENCE_S:
        return ERROR, remark or f'no samples for {status.age_s:.1f} s; check the sensor and its cable'
    if remark:
        return WARN, remark
    if status.left_out > FEW:
        return WARN, left_out_remark(status.left_out)
    if meter.saturated_part > _SATURATED:
        return WARN, f'{100 * meter.saturated_part:.0f} % of the samples are saturated; reduce the light or the amplifier gain'
    nominal = float(about.get('rate', 0) or 0)
    if live and nominal > 0 and meter.rate < _RATE_TOLERANCE * nominal:
        return WARN, f'{meter.rate:.0f} samples a second instead of {nominal:.0f}: a busy machine'
    return OK, 'waiting for samples, or for a subscriber' if math.isnan(meter.rate) else f'{meter.rate:.0f} Hz'
