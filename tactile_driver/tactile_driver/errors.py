# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The named failures of tactile drivers; each message says what, where and what to do. And how the commands of all packages report them."""
from __future__ import annotations

import functools
import signal
import sys
from collections.abc import Callable, Mapping
from types import MappingProxyType


class TactileError(Exception):
    """Base of all failures raised by this package."""


class BadArgument(TactileError, ValueError):
    """An argument or parameter is wrong: its name, value and range are in the message."""


class BadFrame(TactileError):
    """A frame cannot be used (wrong size, corrupt ...): count it, report it, skip it. partial: topic -> messages that could be made of it
    before."""

    partial: Mapping[str, list] = MappingProxyType({})


class DeviceLost(TactileError):
    """A device does not exist, does not answer or was unplugged: retried with back-off."""


class BadRecording(TactileError, ValueError):
    """A recording (video, folder, bag) is missing, empty or unreadable."""


def by_name(table: Mapping, name: str, what: str):
    """table[name]. Raises BadArgument, which lists the names, for an unknown one; what: the table names."""
    if name not in table:
        raise BadArgument(f'{what} {name!r} is unknown; choose one of {", ".join(table)}')
    return table[name]


def tells_errors(name: str, *more: type[Exception]) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Decorator for the main function of the command name: a TactileError, or an error of the types more, is printed as one line on
    standard error and the exit code is 1."""
    def _decorated(main: Callable[..., int]) -> Callable[..., int]:
        @functools.wraps(main)
        def _main(*args, **kwargs) -> int:
            if signal.getsignal(signal.SIGINT) == signal.SIG_DFL:
                signal.signal(signal.SIGINT, signal.default_int_handler)
            try:
                return main(*args, **kwargs)
            except (TactileError, *more) as error:
                print(f'{name}: {error}', file=sys.stderr)
                return 1
        return _main
    return _decorated
