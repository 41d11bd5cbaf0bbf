# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The /diagnostics of a camera's node, from the state of its capture. No ROS but the levels."""
from __future__ import annotations

import math

from ..runtime.diagnostics import ERROR, OK, WARN, Health, common_values
from ...sources.base.capture import CaptureStatus

_RATE_TOLERANCE = 0.9  # share of the nominal rate below which a warning is given; chosen
_SILENCE_PERIODS, _SHORTEST_SILENCE = 5, 1.0  # frame periods and s without a frame that are an error; chosen
#: why a device's rate is low, beside a busy machine
CAMERA_IS_SLOW = 'too little light (long exposure), a slow USB port or pixel format, or '
FEW = 0.05  # share of skipped frames that is not reported: other work of the machine for a moment; chosen


def unconfigured_health(problem: str, retrying: bool) -> Health:
    """The health of a node without a source. problem: why, '' before the first attempt; retrying: whether the node tries again."""
    if not problem:
        return Health(OK, 'not configured yet', common_values('unconfigured'))
    what = problem + ('; the node retries' if retrying else '')
    return Health(ERROR, what, {**common_values('unconfigured'), 'last error': problem})


def capture_health(status: CaptureStatus, about: dict, live: bool, remark: str, slow: str = '') -> Health:
    """The health of a node with an open source. about: the source's description; live: whether it runs by itself; remark: a warning, '';
    slow: why a device may be slow."""
    nominal = float(about.get('rate', 0) or 0)
    values = {**common_values(status.state, status.rate, status.age_s, status.dropped), 'source': about.get('source', ''),
              'device': about.get('path') or about.get('device', ''), 'serial': about.get('serial', ''),
              'nominal rate (Hz)': nominal if nominal > 0 else math.nan, 'frames': status.received, 'corrupt': status.corrupt,
              'last error': status.error}
    values |= {shown: about[name] for name, shown in (('unpaired', 'unpaired'), ('lost', 'lost frames')) if name in about}
    level, message = _judged(status, nominal, live, bool(about.get('idle')), remark, slow if about.get('source') == 'device' else '')
    if level == OK and remark:
        level, message = WARN, remark
    return Health(level, message, values)


def left_out_remark(share: float) -> str:
    """The warning for a skipped share of the frames, 0 to 1."""
    return (f'{100 * share:.0f} % of the frames are skipped: this machine is too slow; lower the rate, choose a faster method or end other '
            'programs')


def _judged(status: CaptureStatus, nominal: float, live: bool, idle: bool, remark: str, slow: str) -> tuple[bytes, str]:
    if status.state in ('lost', 'failed'):
        return ERROR, status.error
    if status.state != 'running':
        return OK, {'paused': 'ready, not active', 'ended': 'the recording is over; clean up and configure to play it again'}[status.state]
    if status.failing:
        return ERROR, status.error
    if idle:
        return OK, 'nobody subscribes'
    if live and status.age_s > max(_SHORTEST_SILENCE, _SILENCE_PERIODS / max(nominal, 1.0)):
        return ERROR, remark or f'no frame for {status.age_s:.1f} s; check the sensor and its cable'
    if live and nominal > 0 and status.rate < _RATE_TOLERANCE * nominal:
        return WARN, f'{status.rate:.1f} Hz instead of {nominal:.1f} Hz: {slow}a busy machine'
    if status.left_out > FEW:
        return WARN, left_out_remark(status.left_out)
    return OK, 'waiting for the first frame' if math.isnan(status.rate) else f'{status.rate:.1f} Hz'
