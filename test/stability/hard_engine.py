# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Applies the input cases to an estimator, checks the outcomes, and records them.

An estimator is a function from named arrays to named arrays; unknown results are NaN or empty arrays.
"""
from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tactile_perception.errors import TactileError

Arrays = dict[str, np.ndarray]
UNITS = 1000.0


@dataclass(frozen=True)
class Estimator:
    """good: makes the inputs; run: the estimator, afresh each time; spoiled: inputs that the cases spoil; rows: inputs whose entries (first
    axis) belong together and have no order; along: outputs in the same order; each: whether every entry is worked out by itself; metres:
    power of a metre in inputs and outputs; sizes: power by which outputs grow with the spoiled inputs alone; tolerance, single, kept: what
    another order or unit, single precision, and one bad entry may change, relative to the largest number of an output."""

    good: Callable[[], Arrays]
    run: Callable[[Arrays], Arrays]
    spoiled: tuple[str, ...]
    rows: tuple[str, ...] = ()
    along: tuple[str, ...] = ()
    metres: dict[str, int] = field(default_factory=dict)
    each: bool = False
    sizes: dict[str, int] = field(default_factory=dict)
    tolerance: float = 1e-9
    single: float = 1e-5
    kept: float = 0.05


def _each(change):
    """A case that changes each of the spoiled inputs."""
    return lambda of, inputs: inputs | {name: change(np.array(inputs[name], float)) for name in of.spoiled}


def _with(value, some):
    def change(array):
        array[some(array)] = value
        return array
    return _each(change)


def _middle(array):
    return np.unravel_index(array.size // 2, array.shape)


def _sized(size):
    return _each(lambda array: array * (size / max(float(np.abs(array[np.isfinite(array)]).max(initial=0.0)), 1e-300)))


def _few(count):
    return lambda of, inputs: inputs | {name: inputs[name][:count] for name in of.rows}


def _single(of, inputs):
    return {name: np.float32(value) if np.asarray(value).dtype.kind == 'f' else value for name, value in inputs.items()}


def order_of(inputs, of):
    """The other order in which case `other order` has the entries."""
    return np.random.default_rng(8).permutation(len(inputs[of.rows[0]])) if of.rows else None


def _other_order(of, inputs):
    order = order_of(inputs, of)
    return inputs | {name: inputs[name][order] for name in of.rows}


def _scaled(of, inputs):
    return {name: value * UNITS**of.metres[name] if of.metres.get(name) else value for name, value in inputs.items()}


def _at_one_place(array):
    return np.broadcast_to(array[:1], array.shape).copy() if array.ndim else array


def _on_a_line(array):
    if not array.ndim:
        return array
    return array[:1] + np.linspace(0, 1, len(array)).reshape(-1, *[1] * (array.ndim - 1)) * (array[-1:] - array[:1])


SIZES = {'zero': 0.0, 'denormal': 1e-310, 'tiny': 1e-30, 'huge': 1e30, 'largest': 1e300}
EDGES = {
    'one NaN': _with(np.nan, _middle), 'all NaN': _with(np.nan, lambda a: np.s_[...]),
    'one infinite': _with(np.inf, _middle), 'all infinite': _with(-np.inf, lambda a: np.s_[...]),
} | {case: _sized(size) for case, size in SIZES.items()}
SHAPES = {'none': _few(0), 'one': _few(1), 'two': _few(2), 'at one place': _each(_at_one_place), 'on a line': _each(_on_a_line)}
SAME = {'single precision': _single, 'other order': _other_order, 'units x 1000': _scaled}
CASES = EDGES | SHAPES | SAME


class Record:
    """All cases that have run: estimator, case, what was to come out, what came out, and by how much it was off."""

    def __init__(self):
        self.rows: list[dict] = []

    def note(self, estimator: str, case: str, expected: str, outcome: str, error: float = float('nan'), unit: str = '') -> None:
        """One case; error: in the unit named."""
        self.rows.append({'estimator': estimator, 'case': case, 'expected': expected, 'outcome': outcome,
                          'error': None if np.isnan(error) else float(f'{error:.3g}'), 'unit': unit})

    def write(self, folder: Path) -> None:
        """stability.json and stability.md in a folder; nothing where no case has run."""
        if not self.rows:
            return
        folder.mkdir(exist_ok=True)
        (folder / 'stability.json').write_text(json.dumps(self.rows, indent=1) + '\n')
        lines = ['| estimator | case | must come out | came out | error |', '|---|---|---|---|---|']
        lines += [f'| {row["estimator"]} | {row["case"]} | {row["expected"]} | {row["outcome"]} | '
                  f'{"" if row["error"] is None else row["error"]} {row["unit"]} |' for row in self.rows]
        (folder / 'stability.md').write_text('\n'.join(lines) + '\n')


def outcome_of(of: Estimator, inputs: Arrays) -> tuple[str, Arrays | None]:
    """('refused', None) or ('nothing' or 'told', outputs). Fails for any error but a named one, an infinite number, a changed input."""
    kept = {name: np.array(value, copy=True) for name, value in inputs.items()}
    try:
        with np.errstate(all='ignore'):
            found = of.run(inputs)
    except TactileError as error:
        assert str(error), 'a named error says what is wrong'
        return 'refused', None
    for name, value in kept.items():
        assert np.array_equal(value, inputs[name], equal_nan=value.dtype.kind == 'f'), f'input {name} was changed'
    for name, value in found.items():
        assert not np.isinf(np.asarray(value, float)).any(), f'{name} is infinite: {value}'
    return ('told' if any(np.isfinite(np.asarray(v, float)).any() for v in found.values()) else 'nothing'), found


def off(found: Arrays, wanted: Arrays, known_to_both: bool = False) -> float:
    """Largest difference, relative to the largest number of each output; infinite where one is known and the other not, unless only what
    is known to both counts (and neither spread nor flags, which may grow)."""
    worst = 0.0
    for name, value in wanted.items():
        a, b = np.asarray(found[name], float), np.asarray(value, float)
        if known_to_both and name in ('spread', 'flags'):
            continue
        if a.shape != b.shape:
            return np.inf
        known = np.isfinite(a) & np.isfinite(b)
        if not known_to_both and (np.isfinite(a) != np.isfinite(b)).any():
            return np.inf
        if known.any():
            worst = max(worst, float(np.abs(a - b)[known].max() / max(np.abs(b[known]).max(), 1e-300)))
    return worst


def wanted_of(of: Estimator, case: str, good: Arrays, plain: Arrays) -> Arrays:
    """What has to come out of a case that changes order, units, size or the number of entries and nothing else."""
    if case in SHAPES and of.each:
        rows = {'none': slice(0, 0), 'one': slice(0, 1), 'two': slice(0, 2), 'at one place': np.zeros(len(good[of.rows[0]]), int)}[case]
        return {name: np.asarray(value)[rows] if name in of.along else value for name, value in plain.items()}
    if case == 'other order':
        order = order_of(good, of)
        return {name: np.asarray(value)[order] if name in of.along else value for name, value in plain.items()}
    if case == 'units x 1000':
        return {name: np.asarray(value) * UNITS**of.metres.get(name, 0) for name, value in plain.items()}
    if case in SIZES:
        factor = SIZES[case] / np.abs(good[of.spoiled[0]]).max()
        return {name: np.asarray(value) * factor**of.sizes.get(name, 0) for name, value in plain.items()}
    return plain
