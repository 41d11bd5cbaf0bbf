# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every constant halved and doubled, on fixed simulated scenes of its sensor: the tables of docs/constants.md.

    python3 test/benchmark/constants.py [ROOM ...]

A constant is a field of a frozen dataclass (tactile_driver/constants.py), so that a new one is in the table by itself. Its effect is the
largest relative change of an error of the scenes. One that the scenes do not read has no effect that they could show.
"""
import sys
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'tactile_perception/test/helpers'))
from changed_constants import changed  # noqa: E402
from press_scenes import OnDomeOfOtherTips, OnSheetOfOtherTips, results  # noqa: E402

from tactile_perception.press.constants import DOME, PRESS, SHEET  # noqa: E402


class Room(NamedTuple):
    """Structs of constants, and a function that computes the errors of the room's scenes: smaller is better, and none is zero."""

    structs: tuple
    errors: Callable[[], np.ndarray]


def press_errors(surface) -> np.ndarray:
    """Of 48 scenes: share with a wrong number of contacts, mean errors of position and depth, m, and of the covariances as logs."""
    counted, position, depth, chi_squares = results(surface(), scenes=48)
    spread = np.abs(np.log(np.median(chi_squares) / 1.386)) if len(chi_squares) else np.inf  # 1.386: that of two normal numbers
    return np.array([1 + 10 * np.mean(~counted), np.mean(np.abs(position)), np.mean(np.abs(depth)), 1 + spread / np.log(4)])


ROOMS = {'sheet': Room((PRESS, SHEET), lambda: press_errors(OnSheetOfOtherTips)),
         'dome': Room((PRESS, DOME), lambda: press_errors(OnDomeOfOtherTips))}


def times(value, factor: float):
    """Multiply a number, or each of a tuple; a count stays one."""
    if isinstance(value, tuple):
        return tuple(times(one, factor) for one in value)
    return max(1, round(factor * value)) if isinstance(value, int) else factor * value


@contextmanager
def noted(structs):
    """Yield the set of (struct's index, field's name) that are read within the with statement."""
    read, before = set(), {type(one): type(one).__getattribute__ for one in structs}

    def reading(self, name):
        read.update((k, name) for k, one in enumerate(structs) if one is self)
        return object.__getattribute__(self, name)

    for kind in before:
        kind.__getattribute__ = reading
    try:
        yield read
    finally:
        for kind in before:
            del kind.__getattribute__


@lru_cache
def effects(name: str) -> dict:
    """(struct, field) -> relative change of the most affected error with the constant halved, and doubled; NaN if it is not read."""
    room = ROOMS[name]
    room.errors()  # what is computed once is computed with the constants as they are
    with noted(room.structs) as read:
        usual, found = room.errors(), {}
    for k, struct in enumerate(room.structs):
        for field in fields(struct):
            value, growth = getattr(struct, field.name), [np.nan, np.nan]
            if (k, field.name) in read:
                for side, factor in enumerate((0.5, 2.0)):
                    with changed(struct, **{field.name: times(value, factor)}), np.errstate(all='ignore'):
                        change = np.nan_to_num(room.errors() / usual - 1, nan=np.inf)
                        growth[side] = float(change[np.argmax(np.abs(change))])
            found[type(struct).__name__, field.name] = tuple(growth)
    return found


def table(name: str) -> str:
    """The constants that the scenes of a room read, in Markdown: a table of those with an effect, and the names of the others."""
    lines, idle = ['| constant | value | halved | doubled |', '|---|---|---|---|'], []
    for struct in ROOMS[name].structs:
        for field in fields(struct):
            growth, full_name = effects(name)[type(struct).__name__, field.name], f'`{type(struct).__name__}.{field.name}`'
            if (np.abs(growth) < 0.01).all():
                idle.append(full_name)
            elif not np.isnan(growth).all():
                lines.append(f'| {full_name} | {plain(getattr(struct, field.name))} | {" | ".join(map(_percent, growth))} |')
    return '\n'.join([f'### {name.capitalize()}', '', *lines, '', f'Neither changes an error: {", ".join(idle)}.'])


def unread(names) -> str:
    """The constants that none of the scenes of these rooms reads."""
    read = {key for name in names for key, growth in effects(name).items() if not np.isnan(growth).all()}
    return 'Read by none of these scenes: ' + ', '.join(f'`{field}`' for field in dict.fromkeys(
        key[1] for name in names for key in effects(name) if key not in read)) + '.'


def plain(value) -> str:
    return ', '.join(map(plain, value)) if isinstance(value, tuple) else f'{value:g}'


def _percent(growth: float) -> str:
    return 'none' if abs(growth) < 0.01 else f'{100 * growth:+.0f} %' if growth < 10 else 'fails'


if __name__ == '__main__':
    rooms = sys.argv[1:] or list(ROOMS)
    print('\n\n'.join([*map(table, rooms), unread(rooms)]))
