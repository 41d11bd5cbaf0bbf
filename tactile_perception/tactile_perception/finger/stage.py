# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger's stage: blocks of voltages in, contacts out."""
from __future__ import annotations

import copy
import math
from collections.abc import Collection, Mapping

import numpy as np
from std_msgs.msg import Header

from tactile_driver.nodes.messages.conversions import header_of, stamp_ns_of
from tactile_driver.sources.source import NS
from tactile_msgs.msg import Contacts, PsdVoltages

from ..common import messages as convert
from ..core.errors import BadFrame
from ..core.stage import Input, Stage
from .constants import FINGER
from .model import FingerModel, read_psd
from .parameters import PSD_PARAMETERS, make_finger

_OUTPUTS = ('x1', 'y1', 'x2', 'y2')


class FingerStage(Stage):
    """The stage of the PSD finger: voltages in, contacts out.

    Parameters
    ----------
    values : Mapping
        Values of PSD_PARAMETERS.

    Attributes
    ----------
    finger : PsdFinger
        The finger that it runs.

    Raises
    ------
    BadArgument
        If the method is unknown.
    BadCalibration
        If the calibration file cannot be used.
    """

    node, parameters, outputs = 'psd_contact_node', PSD_PARAMETERS, {'contacts': Contacts}
    input = Input('voltages', PsdVoltages, depth=200)  # a second of blocks: no sample may be lost

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
        """Check a message before it is processed.

        Parameters
        ----------
        message : PsdVoltages
            Block of samples.

        Raises
        ------
        BadFrame
            If samples are incomplete, a voltage is impossible, the period is invalid, or stamps would overflow.
        """
        count, period_s = len(message.voltages), message.sample_period
        if count % 4 or not count:
            raise BadFrame(f'{count} voltages; a sample has four: the driver must publish whole samples')
        if not (FINGER.min_period_s <= period_s <= FINGER.max_period_s or (math.isnan(period_s) and count == 4)):
            raise BadFrame(f'sample_period is {period_s} s; it must be from {FINGER.min_period_s:g} to {FINGER.max_period_s:g} '
                           '(NaN only for a single sample)')
        if np.count_nonzero(np.abs(np.frombuffer(message.voltages, np.float32)) > FINGER.max_volts):
            raise BadFrame(f'a voltage is beyond {FINGER.max_volts:g} V; publish NaN for an unknown sample')
        if message.header.stamp.sec + count * FINGER.max_period_s > np.iinfo(np.int32).max:
            raise BadFrame(f'stamp {message.header.stamp.sec} s is near the largest stamp; the publisher must stamp with a clock')

    def estimate(self, message: PsdVoltages, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """Contacts of one block: at its own stamp, and at those of the samples where a contact begins or ends.

        Parameters
        ----------
        message : PsdVoltages
            Block of samples that passed `check`.
        stamp_s : float
            Stamp of its first sample in s.
        topics : collection of str
            Ignored: there is one output.

        Returns
        -------
        dict
            ``contacts`` to a list of Contacts.

        Raises
        ------
        BadFrame
            If a single sample has no period.
        """
        period_s = message.sample_period
        found = self.finger.estimate(np.frombuffer(message.voltages, np.float32).reshape(-1, 4), stamp_s, period_s)
        if found.needs_period:
            raise BadFrame('a single sample without a sample_period; its period is known from the second one on')
        return {'contacts': [convert.contacts_to_message([one.touch] if one.touch else [],
                                                         later(message.header, one.at * period_s if one.at else 0.0))
                             for one in found.estimates]}

    def health(self) -> tuple[str, dict]:
        """Warning about outputs that are stuck, and values for /diagnostics.

        Returns
        -------
        warning : str
            Empty if all is well.
        values : dict
            State of the reference, and noise of the sum in V.
        """
        stuck = [name for name, dead in zip(_OUTPUTS, self.finger.stuck) if dead]
        warning = f'output {", ".join(stuck)} is stuck; check its amplifier and cable' if stuck else ''
        return warning, {'reference': 'in order' if self.finger.ready else 'being taken', 'noise of the sum (V)': self.finger.sigma}

    def covered_ns(self, message: PsdVoltages) -> int:
        """Duration of a block.

        Parameters
        ----------
        message : PsdVoltages
            Block of samples.

        Returns
        -------
        int
            In ns; 0 where sample_period is not valid.
        """
        seconds = len(message.voltages) / 4 * message.sample_period
        return round(seconds * NS) if 0 < seconds < 3600.0 else 0  # a longer block has no valid sample_period


def later(header: Header, seconds: float) -> Header:
    """Make a header with a later stamp.

    Parameters
    ----------
    header : Header
        Header of a block.
    seconds : float
        Time to add in s.

    Returns
    -------
    Header
    """
    if not seconds:
        return header
    stamp = stamp_ns_of(header) + round(seconds * NS)
    return header_of(stamp, header.frame_id)
