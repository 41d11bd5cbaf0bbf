# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of touches in simulated scenes of sheets, processed with the calibration that ships."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import write_scene
from tactile_perception.bags.judged_bag import JudgedBag
from tactile_perception.evaluation.scores import normalised_square
from tactile_perception.evaluation.touches import pairs

RATE = 30.0
SLOW = 10.0          # of touches at rest
LEAST, APART = 5e-4, 0.0145  # m
TRACE = 0.3e-3       # m: a shallower tip stands on one node of the simulated sheet, up to 0.7 mm beside its place


def errors(folder: Path, scene: str, shutters=None) -> tuple[np.ndarray, int]:
    """(N, 3): place, depth, mm, and normalised squared error of the place, of the frames with a touch deeper than TRACE; and how many were
    told beside.

    scene: its name begins with that of the sensor; shutters: of two cameras.
    """
    found, beside = [], 0
    for told, true in _instants(folder, scene, RATE, shutters):
        if not true.contacts:
            beside += any(touch.depth > TRACE for touch in told.contacts)
        elif told.contacts and true.contacts[0].depth > TRACE:
            found.append(_errors(told.contacts[0], true.contacts[0]))
    return np.array(found), beside


def errors_of_two(folder: Path, scene: str) -> tuple[np.ndarray, float]:
    """(N, 3), as errors, of the touches in frames in which two are told of two at least half a millimetre deep and three radii of the
    shipped fingertips apart; and the share of such frames."""
    found, judged = [], []
    for told, true in _instants(folder, scene, SLOW):
        pair = true.contacts or []
        if len(pair) < 2 or min(tip.depth for tip in pair) < LEAST or np.hypot(*(pair[0].position - pair[1].position)[:2]) < APART:
            continue
        judged.append(len(told.contacts) == 2)
        if judged[-1]:
            found += [_errors(touch, tip) for tip, touch in pairs(pair, told.contacts)]
    return np.array(found), float(np.mean(judged))


def _instants(folder: Path, scene: str, rate: float, shutters=None) -> Iterator[tuple]:
    """Results and truth of each frame."""
    files = [Path(share(kind, '_'.join(scene.split('_')[:2]) + '_sim.yaml')) for kind in ('params', 'calibration')]
    write_scene(folder / 'bag', scene, rate, shutters=shutters)
    for _, told, true in JudgedBag(folder / 'bag', params=files[0], calibration=files[1]).instants():
        yield told, true


def _errors(touch, tip) -> tuple[float, float, float]:
    """Place, depth, mm, and normalised squared error of the place."""
    off = touch.position - tip.position
    return 1e3 * np.hypot(*off[:2]), 1e3 * abs(touch.depth - tip.depth), normalised_square(off, touch.position_covariance)[0] / 3
