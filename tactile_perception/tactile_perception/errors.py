# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The named failures of tactile perception; each message says what, where and what to do."""


class TactileError(Exception):
    """Base of all failures raised by this package."""


class BadArgument(TactileError, ValueError):
    """An argument or parameter is wrong: its name, value and range are in the message."""


class BadFrame(TactileError):
    """A frame cannot be used (black, constant, wrong size, no dots ...): count it, report it, skip it."""


class BadCalibration(TactileError, ValueError):
    """A calibration file is missing, broken, for another sensor, or its data cannot determine the model."""


class DegenerateFit(TactileError):
    """A fit has no single answer from these points; `reason` names why (too_few, coincident, collinear, reflection)."""

    def __init__(self, reason: str, message: str):
        super().__init__(f'{reason}: {message}')
        self.reason = reason
