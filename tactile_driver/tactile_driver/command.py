# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the commands of all packages share: what is wrong is said in one line."""
from __future__ import annotations

import functools
import sys
from collections.abc import Callable

from .errors import TactileError


def tells_errors(name: str, *more: type[Exception]) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Decorates the main of the command name: a TactileError that it raises, or one of more, is one line on the standard error and the
    exit code 1."""
    def _decorated(main: Callable[..., int]) -> Callable[..., int]:
        @functools.wraps(main)
        def _main(*args, **kwargs) -> int:
            try:
                return main(*args, **kwargs)
            except (TactileError, *more) as error:
                print(f'{name}: {error}', file=sys.stderr)
                return 1
        return _main
    return _decorated
