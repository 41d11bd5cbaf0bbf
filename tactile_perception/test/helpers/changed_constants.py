# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Other values of constants, for tests and studies."""
from contextlib import contextmanager


@contextmanager
def changed(constants, **values):
    """Change fields of a frozen dataclass within a with statement; everybody sees the change."""
    before = {name: getattr(constants, name) for name in values}
    for name, value in values.items():
        object.__setattr__(constants, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            object.__setattr__(constants, name, value)
