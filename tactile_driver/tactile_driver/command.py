# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Error reporting shared by the commands of all packages: one line per error."""
from __future__ import annotations

import functools
import signal
import sys
from collections.abc import Callable

from .errors import TactileError


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
