# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The /diagnostics of a driver's node, from the state of its capture. No ROS but the levels."""
from __future__ import annotations

import math
import time
from collections import deque

import numpy as np

from ..sources.capture import CaptureStatus
from ..sources.constants import SOURCES
from .constants import NODES
from .runtime.diagnostics import ERROR, OK, WARN, Health, common_values

_STATES = {'paused': 'ready, not active', 'ended': 'ended: the recording is over; clean up and configure to play it again'}
#: key of the number of messages that were published before the first one arrived
MISSED = 'missed at start'
#: what of a source's description changes while it runs and is reported as it is, under its name or another one
COUNTS = {'lost': 'lost frames', 'missed': MISSED, **{name: name for name in (
    'unpaired', 'crc errors', 'refused frames', 'garbage bytes', 'missing frames', 'missing samples', 'resets', 'shutter offset (ms)')}}


class SampleMeter:
    """Counts samples. saturation: V, from which an output is saturated; rate: samples per second lately, NaN until known; saturated_part:
    share of saturated ones lately, 0 to 1."""

    def __init__(self, saturation: float):
        self._saturation = saturation
        self.samples = 0
        self._recent: deque[tuple[float, int, int]] = deque()  # monotonic s, samples, saturated ones

    def add(self, volts: np.ndarray) -> None:
        """Count samples (N, 4), V."""
        self.samples += len(volts)
        now = time.monotonic()
        self._recent.append((now, len(volts), int((volts >= self._saturation).any(axis=1).sum())))
        while self._recent[0][0] < now - SOURCES.window_s:
            self._recent.popleft()

    def _lately(self) -> np.ndarray:
        recent = np.array(list(self._recent)).reshape(-1, 3)  # another thread adds
        return recent[recent[:, 0] >= time.monotonic() - SOURCES.window_s]

    @property
    def rate(self) -> float:
        """See above."""
        times, counts, _ = self._lately().T
        return float(counts[1:].sum() / (times[-1] - times[0])) if len(times) > 2 and times[-1] > times[0] else math.nan

    @property
    def saturated_part(self) -> float:
        """See above."""
        _, counts, high = self._lately().T
        return float(high.sum() / max(counts.sum(), 1))


def unconfigured_health(problem: str, retrying: bool) -> Health:
    """The health of a node without a source. problem: why, '' before the first attempt; retrying: whether the node tries again."""
    if not problem:
        return Health(OK, 'not configured yet', common_values('unconfigured'))
    what = problem + ('; the node retries' if retrying else '')
    return Health(ERROR, what, {**common_values('unconfigured'), 'last error': problem})


def capture_health(status: CaptureStatus, about: dict, live: bool, warning: str, meter: SampleMeter | None = None) -> Health:
    """The health of a node with an open source. about: the source's description, with `limit` where it says why it may be slow; live:
    whether it runs by itself; warning: about the data, '' for none; meter: of a source of samples, whose rate is that of the samples."""
    nominal, rate = float(about.get('rate', 0) or 0), status.rate if meter is None else meter.rate
    values = {**common_values(status.state, rate, status.age_s, status.dropped), 'source': about.get('source', ''),
              'device': about.get('path') or about.get('device', ''), 'serial': about.get('serial', ''),
              'nominal rate (Hz)': nominal if nominal > 0 else math.nan, 'frames': status.received, 'corrupt': status.corrupt,
              'last error': status.error, **{shown: about[name] for name, shown in COUNTS.items() if name in about}}
    if meter is not None:
        values |= {'samples': meter.samples, 'saturated (%)': 100 * meter.saturated_part, 'messages': values.pop('frames')}
    level, message = _judged(status, about, rate, live, warning)
    if level == OK and status.state == 'running' and meter is not None and meter.saturated_part > NODES.max_saturated_share:
        level, message = WARN, f'{100 * meter.saturated_part:.0f} % of the samples are saturated; reduce the light or the amplifier gain'
    return Health(WARN, warning, values) if level == OK and warning else Health(level, message, values)


def _judged(status: CaptureStatus, about: dict, rate: float, live: bool, warning: str) -> tuple[bytes, str]:
    nominal, limit = float(about.get('rate', 0) or 0), about.get('limit', '')
    if status.state in ('lost', 'failed'):
        return ERROR, status.error
    if status.state != 'running':
        return OK, _STATES[status.state]
    if status.failing:
        return ERROR, status.error
    if about.get('idle'):
        return OK, 'nobody subscribes'
    if live and status.age_s > max(SOURCES.min_silence_s, SOURCES.max_silent_periods / max(nominal, 1.0)):
        return ERROR, warning or f'no frame for {status.age_s:.1f} s; check the sensor and its cable'
    if live and nominal > 0 and rate < NODES.min_rate_share * nominal:
        return WARN, f'{rate:.1f} Hz instead of {nominal:.1f} Hz; {limit}{" " if limit else ""}a busy machine'
    if status.left_out > NODES.max_skipped_share:
        return WARN, (f'{100 * status.left_out:.0f} % of the frames are skipped: this machine is too slow; lower the rate, choose a faster '
                      'method or end other programs')
    return OK, 'waiting for the first frame' if math.isnan(rate) else f'{rate:.1f} Hz'
