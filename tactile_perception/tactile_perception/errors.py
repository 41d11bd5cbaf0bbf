# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The named failures of tactile perception, those that it shares with the drivers among them; each message says what, where and what
to do.
"""
from tactile_driver.errors import BadArgument, BadFrame, BadRecording, TactileError, by_name

__all__ = ['BadArgument', 'BadCalibration', 'BadFrame', 'BadRecording', 'ClockSetBack', 'TactileError', 'by_name']


class BadCalibration(TactileError, ValueError):
    """A calibration file is missing, broken, for another sensor, or its data cannot determine the model."""


class ClockSetBack(BadFrame):
    """Stamps went back far, as where a recording begins again; what is known begins anew if the next frame goes on from there."""
