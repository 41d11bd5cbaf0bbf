# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Indexing, tracking and reference of dots as functions of arrays, and images of dots for the detectors."""
from __future__ import annotations

import cv2
import numpy as np
from hard_engine import Estimator
from tactile_perception.dots.number import METHODS, Linker
from tactile_perception.dots.pattern import Pattern
from tactile_perception.dots.reference import Reference

ROWS, COLUMNS, SPACING, SIZE = 9, 13, 34.0, (480, 360)  # rows and columns of the grid; px; px
FINE = 4


def grid(rows=ROWS, columns=COLUMNS, pitch=SPACING, size=SIZE):
    """(rows * columns, 2) px, in the middle of an image, hardly bent and turned."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    place = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1) * pitch
    place = place * (1 - 0.03 * np.sum(place**2, axis=1, keepdims=True) / np.sum(place[0]**2))
    turn = np.array([[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]])
    return place @ turn.T + np.array(size) / 2


def bulge(uv):
    """Places after a press that pushes them up to 6 px apart."""
    away = uv - [200, 150]
    return uv + away * (0.09 * np.exp(-np.sum(away**2, axis=1) / (2 * 60**2)))[:, None]


def random_pattern(count=90, seed=4):
    """(count, 2) px, no two nearer than 20 px."""
    rng, found = np.random.default_rng(seed), np.zeros((0, 2))
    while len(found) < count:
        place = rng.uniform([15, 15], [465, 345])
        if not len(found) or np.hypot(*(found - place).T).min() > 20:
            found = np.vstack([found, place])
    return found


def drawn(uv, diameter, size=SIZE, ground=40.0, contrast=140.0, blur=0.9, noise=1.0, seed=0):
    """uint8 (H, W): bright discs at uv (N, 2) px of a diameter, px, drawn finely, blurred and seen with noise."""
    fine = np.zeros((size[1] * FINE, size[0] * FINE), np.uint8)
    for place in uv:
        centre = np.round(((place + 0.5) * FINE - 0.5) * 256).astype(int)
        cv2.circle(fine, centre.tolist(), round(diameter / 2 * FINE * 256), 255, -1, cv2.LINE_AA, 8)
    shape = cv2.GaussianBlur(cv2.resize(fine, size, interpolation=cv2.INTER_AREA).astype(np.float32), (0, 0), blur) / 255
    grains = np.random.default_rng(seed).normal(0, 1, shape.shape) * noise
    return np.clip(np.rint(ground + contrast * shape + grains), 0, 255).astype(np.uint8)


def numbers(id):
    """Numbers as floats, NaN for a dot without one."""
    return np.where(np.asarray(id) >= 0, id, np.nan).astype(float)


def _grid_numbers(method):
    def run(inputs):
        found = METHODS[method](ROWS, COLUMNS).number(inputs['uv'], *SIZE)
        return {'id': numbers(found.id) if found.certain else np.full(len(inputs['uv']), np.nan)}
    return run


def _linked(inputs):
    """Numbers of the second frame by the places in the first."""
    link = Linker()
    link.update(inputs['before'], 0.0)
    return {'id': numbers(link.update(inputs['uv'], 0.1))}


def _displaced(inputs):
    reference, id = Reference(), inputs['id'].astype(int)
    reference.update(id, inputs['before'], np.full(len(id), 0.02), 0.0, COLUMNS)
    return {'duv': reference.update(id, inputs['uv'], np.full(len(id), 0.02), 0.1, COLUMNS)}


def _two():
    return {'id': np.arange(ROWS * COLUMNS), 'before': grid(), 'uv': bulge(grid())}


def _whole(method):
    return Estimator(lambda: {'uv': bulge(grid())}, _grid_numbers(method), ('uv',), ('uv',), ('id',))


DOTS = {
    'numbers, lattice': _whole('lattice'), 'numbers, paper': _whole('paper'),
    'numbers, register': Estimator(lambda: {'uv': bulge(random_pattern())}, lambda i: {
        'id': numbers(Pattern(random_pattern()).match(i['uv']))}, ('uv',), ('uv',), ('id',)),
    'numbers, tracks': Estimator(lambda: {'before': random_pattern(), 'uv': bulge(random_pattern())}, _linked, ('uv',), ('uv',), ('id',)),
    'reference': Estimator(_two, _displaced, ('uv',), ('id', 'before', 'uv'), ('duv',)),
}
