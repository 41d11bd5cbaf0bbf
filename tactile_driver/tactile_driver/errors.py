# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Named errors of the drivers, and how the commands of all packages report them.

Each message says what happened, where, and what to do.
"""
from __future__ import annotations

import functools
import signal
import sys
from collections.abc import Callable, Mapping
from types import MappingProxyType


class TactileError(Exception):
    """Base class of all errors that these packages raise on purpose."""


class BadArgument(TactileError, ValueError):
    """An argument or parameter is wrong. The message names it, its value and its range."""


class BadFrame(TactileError):
    """A frame cannot be used, for example because of its size or because it is corrupt. Count it, report it, and skip it.

    Attributes
    ----------
    partial : Mapping
        Topic to messages that were made of the frame before the error occurred.
    """

    partial: Mapping[str, list] = MappingProxyType({})


class DeviceLost(TactileError):
    """A device does not exist, does not answer or was unplugged. The driver tries to open it again."""


class BadRecording(TactileError, ValueError):
    """A recording (video, folder, bag) is missing, empty or unreadable."""


def by_name(table: Mapping, name: str, what: str):
    """Entry of a table.

    Parameters
    ----------
    table : Mapping
        Name to entry.
    name : str
        Name of the entry.
    what : str
        What the names of the table stand for, used in the error message.

    Returns
    -------
    object
        The entry.

    Raises
    ------
    BadArgument
        If there is no entry of that name; the message lists the names.

    Examples
    --------
    >>> by_name({'bag': 1, 'file': 2}, 'file', 'source')
    2
    >>> by_name({'bag': 1, 'file': 2}, 'fil', 'source')
    Traceback (most recent call last):
    ...
    tactile_driver.errors.BadArgument: source 'fil' is unknown; choose one of bag, file
    """
    if name not in table:
        raise BadArgument(f'{what} {name!r} is unknown; choose one of {", ".join(table)}')
    return table[name]


def reports_errors(name: str, *more: type[Exception]) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Decorate the main function of a command: it prints an error as one line on standard error and returns 1.

    Parameters
    ----------
    name : str
        Name of the command, printed before the error.
    *more : type
        Types of errors that are reported in this manner besides `TactileError`.

    Returns
    -------
    callable
        The decorator.
    """
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
