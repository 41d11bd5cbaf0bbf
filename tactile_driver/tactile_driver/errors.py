# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The named failures of tactile drivers; each message says what, where and what to do."""


class TactileError(Exception):
    """Base of all failures raised by this package."""


class BadArgument(TactileError, ValueError):
    """An argument or parameter is wrong: its name, value and range are in the message."""


class BadFrame(TactileError):
    """A frame cannot be used (wrong size, corrupt ...): count it, report it, skip it."""


class DeviceLost(TactileError):
    """A device does not exist, does not answer or was unplugged: retried with back-off."""


class BadRecording(TactileError, ValueError):
    """A recording (video, folder, bag) is missing, empty or unreadable."""
