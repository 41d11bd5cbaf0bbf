# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger's stage from message to message: what psd_contact_node computes, process_bag computes by the same lines."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from builtin_interfaces.msg import Time
from std_msgs.msg import Header
from tactile_msgs.msg import Contact, Contacts, PsdVoltages

from ..calibration.psd_file import read_psd
from ..errors import BadFrame
from ..pipeline.clock import StampClock
from ..pipeline.psd_stage import PsdStage
from ..psd.finger import Touch
from ..psd.model import FingerModel
from . import conversions as convert

_NS = 1_000_000_000


class PsdMessages:
    """voltages -> contacts; values: of PSD_PARAMETERS."""

    def __init__(self, values: Mapping):
        self._values = values
        self._model = read_psd(values['calibration'], values) if values['calibration'] else FingerModel()
        self._clock = StampClock()
        self.stage = PsdStage(self._model, values)

    def on_voltages(self, message: PsdVoltages) -> list[Contacts]:
        """Contacts of one block: under its own stamp, and under those of the samples with which a contact begins or ends.

        Raises BadFrame for a block that cannot be used.
        """
        if len(message.voltages) % 4 or not len(message.voltages):
            raise BadFrame(f'{len(message.voltages)} voltages; there are four a sample: the driver has to publish whole ones')
        stamp_s = convert.stamp_seconds(message.header)
        if self._clock.begins_anew(stamp_s):
            self.stage = PsdStage(self._model, self._values)
        volts = np.frombuffer(message.voltages, np.float32).reshape(-1, 4)
        return [contacts_message(touches, later(message.header, k * message.sample_period if k else 0.0))
                for k, touches in self.stage.process(volts, stamp_s, message.sample_period)]


def later(header: Header, seconds: float) -> Header:
    """The header, s later."""
    if not seconds:
        return header
    stamp = header.stamp.sec * _NS + header.stamp.nanosec + round(seconds * _NS)
    return Header(frame_id=header.frame_id, stamp=Time(sec=stamp // _NS, nanosec=stamp % _NS))


def contacts_message(touches: list[Touch], header: Header) -> Contacts:
    """Contacts under a header."""
    return Contacts(header=header, contacts=[
        Contact(id=t.id, position=convert.point(t.position), normal=convert.vector(t.normal), depth=t.depth, force=t.force,
                position_covariance=t.covariance.ravel(), flags=t.flags) for t in touches])
