# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger's stage on messages; psd_contact_node and process_bag both run it."""
from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from builtin_interfaces.msg import Time
from std_msgs.msg import Header
from tactile_msgs.msg import Contact, Contacts, PsdVoltages

from ...calibration.files.psd import read_psd
from ...errors import BadFrame
from ..messages import conversions as convert
from ...pipeline.clock import StampClock
from ...pipeline.psd_stage import PsdStage
from ...psd.finger import Touch
from ...psd.model import FingerModel

_NS = 1_000_000_000
_SHORTEST_S, _LONGEST_S = 1e-7, 1.0  # between samples: chosen; faster than any converter, slower than a touch lasts
_HIGHEST_V = 1e6  # beyond every converter: chosen
_LAST_S = 2**31 - 1  # largest second of a stamp, an int32


class PsdMessages:
    """voltages -> contacts; values: of PSD_PARAMETERS."""

    def __init__(self, values: Mapping):
        self._values = values
        self._model = read_psd(values['calibration'], values) if values['calibration'] else FingerModel()
        self._clock = StampClock()
        self.stage = PsdStage(self._model, values)

    def on_voltages(self, message: PsdVoltages) -> list[Contacts]:
        """Contacts of one block: at its own stamp, and at those of the samples where a contact begins or ends.

        Raises BadFrame for a block that cannot be used.
        """
        check_block(message)
        stamp_s = convert.stamp_seconds(message.header)
        volts = np.frombuffer(message.voltages, np.float32).reshape(-1, 4)
        with self._clock.at(stamp_s) as anew:
            if anew:
                self.begin_anew()
            found = self.stage.process(volts, stamp_s, message.sample_period)
        return [contacts_message(touches, later(message.header, k * message.sample_period if k else 0.0)) for k, touches in found]

    def begin_anew(self) -> None:
        """Forget all earlier samples."""
        self.stage = PsdStage(self._model, self._values)


def check_block(message: PsdVoltages) -> None:
    """Raise BadFrame for incomplete samples, impossible voltages, an invalid period, and stamps that would overflow."""
    count, period_s = len(message.voltages), message.sample_period
    if count % 4 or not count:
        raise BadFrame(f'{count} voltages; a sample has four: the driver must publish whole samples')
    if not (_SHORTEST_S <= period_s <= _LONGEST_S or (math.isnan(period_s) and count == 4)):
        raise BadFrame(f'sample_period is {period_s} s; it must be from {_SHORTEST_S:g} to {_LONGEST_S:g} (NaN only for a single sample)')
    if np.count_nonzero(np.abs(np.frombuffer(message.voltages, np.float32)) > _HIGHEST_V):
        raise BadFrame(f'a voltage is beyond {_HIGHEST_V:g} V; publish NaN for a sample that is not known')
    if message.header.stamp.sec + count * _LONGEST_S > _LAST_S:
        raise BadFrame(f'stamp {message.header.stamp.sec} s is near the largest stamp; the publisher must stamp with a clock')


def later(header: Header, seconds: float) -> Header:
    """The header with a stamp later by seconds."""
    if not seconds:
        return header
    stamp = convert.stamp_ns_of(header) + round(seconds * _NS)
    return Header(frame_id=header.frame_id, stamp=Time(sec=stamp // _NS, nanosec=stamp % _NS))


def contacts_message(touches: list[Touch], header: Header) -> Contacts:
    """Contacts under a header."""
    return Contacts(header=header, contacts=[
        Contact(id=t.id, position=convert.point(t.position), normal=convert.vector(t.normal), depth=t.depth, force=t.force,
                position_covariance=t.covariance.ravel(), flags=t.flags) for t in touches])
