# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger's stage: blocks of voltages in, contacts out."""
from __future__ import annotations

import copy
import math
from collections.abc import Collection, Mapping

import numpy as np
from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from tactile_msgs.msg import Contacts, PsdVoltages

from ..errors import BadFrame
from ..nodes.messages import conversions as convert
from ..stage import Input, Stage
from .model import FingerModel, read_psd
from .parameters import PSD_PARAMETERS, make_finger

_NS = 1_000_000_000
_SHORTEST_S, _LONGEST_S = 1e-7, 1.0  # between samples: chosen; faster than any converter, slower than a press lasts
_LONGEST_BLOCK_S = 3600.0  # chosen: a longer one has no valid sample_period
_HIGHEST_V = 1e6  # beyond every converter: chosen
_LAST_S = 2**31 - 1  # largest second of a stamp, an int32
_OUTPUTS = ('x1', 'y1', 'x2', 'y2')


class FingerStage(Stage):
    """voltages -> contacts. finger: the PsdFinger that it runs. Raises BadArgument for an unknown method, BadCalibration for a bad file."""

    node, parameters, outputs = 'psd_contact_node', PSD_PARAMETERS, {'contacts': Contacts}
    input = Input('voltages', PsdVoltages, depth=200)  # a second of blocks: no sample may be lost; chosen

    def __init__(self, values: Mapping):
        super().__init__(values)
        model = read_psd(values['calibration'], values) if values['calibration'] else FingerModel()
        self._fresh = make_finger(model, values)
        self.reset()

    def reset(self) -> None:
        """Drop all earlier samples."""
        self.finger = copy.copy(self._fresh)

    def set_reference(self) -> None:
        """Take the untouched reference from the next samples."""
        self.finger.set_reference()

    @staticmethod
    def check(message: PsdVoltages) -> None:
        """Raise BadFrame for incomplete samples, impossible voltages, an invalid period, and stamps that would overflow."""
        count, period_s = len(message.voltages), message.sample_period
        if count % 4 or not count:
            raise BadFrame(f'{count} voltages; a sample has four: the driver must publish whole samples')
        if not (_SHORTEST_S <= period_s <= _LONGEST_S or (math.isnan(period_s) and count == 4)):
            raise BadFrame(f'sample_period is {period_s} s; it must be from {_SHORTEST_S:g} to {_LONGEST_S:g} '
                           '(NaN only for a single sample)')
        if np.count_nonzero(np.abs(np.frombuffer(message.voltages, np.float32)) > _HIGHEST_V):
            raise BadFrame(f'a voltage is beyond {_HIGHEST_V:g} V; publish NaN for a sample that is not known')
        if message.header.stamp.sec + count * _LONGEST_S > _LAST_S:
            raise BadFrame(f'stamp {message.header.stamp.sec} s is near the largest stamp; the publisher must stamp with a clock')

    def estimate(self, message: PsdVoltages, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """Contacts of one block: at its own stamp, and at those of the samples where a contact begins or ends."""
        period_s = message.sample_period
        found = self.finger.estimate(np.frombuffer(message.voltages, np.float32).reshape(-1, 4), stamp_s, period_s)
        if found.needs_period:
            raise BadFrame('a single sample without a sample_period; its period is known from the second one on')
        return {'contacts': [convert.contacts_to_message([one.touch] if one.touch else [],
                                                         later(message.header, one.at * period_s if one.at else 0.0))
                             for one in found.estimates]}

    def health(self) -> tuple[str, dict]:
        """Warns of outputs that are stuck."""
        stuck = [name for name, dead in zip(_OUTPUTS, self.finger.stuck) if dead]
        warning = f'output {", ".join(stuck)} is stuck; check its amplifier and cable' if stuck else ''
        return warning, {'reference': 'in order' if self.finger.ready else 'being taken', 'noise of the sum (V)': self.finger.sigma}

    def covered_ns(self, message: PsdVoltages) -> int:
        """Duration of a block, ns; 0 where sample_period is not valid."""
        seconds = len(message.voltages) / 4 * message.sample_period
        return round(seconds * _NS) if 0 < seconds < _LONGEST_BLOCK_S else 0


def later(header: Header, seconds: float) -> Header:
    """The header with a stamp later by seconds."""
    if not seconds:
        return header
    stamp = convert.stamp_ns_of(header) + round(seconds * _NS)
    return Header(frame_id=header.frame_id, stamp=Time(sec=stamp // _NS, nanosec=stamp % _NS))
