# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Named errors of tactile perception, and those that it shares with the drivers. Each message says what happened, where, and what to do."""
from tactile_driver.errors import BadArgument, BadFrame, BadRecording, TactileError, by_name

__all__ = ['BadArgument', 'BadCalibration', 'BadFrame', 'BadRecording', 'ClockSetBack', 'TactileError', 'by_name']


class BadCalibration(TactileError, ValueError):
    """A calibration file is missing, damaged or of another sensor, or its data cannot determine the model."""


class ClockSetBack(BadFrame):
    """A stamp went far back, as when a recording restarts. The stage is reset if the next frame continues from there."""
