# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxels that measure a force vector each: their layout, and one frame of them."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from ..errors import BadArgument, BadFrame
from .constants import FORCE_TAXEL_DRIVER


@dataclass(frozen=True)
class TaxelLayout:
    """Where taxels are and what their numbers mean.

    Parameters
    ----------
    positions, normals : ndarray, shape (N, 3)
        Positions in m, and unit normals out of the sensor, in the sensor frame.
    axes : ndarray, shape (N, 3, 3)
        Rows: the directions, in the sensor frame, of a force on the sensor that gives a positive first, second and third number.
    """

    positions: np.ndarray
    normals: np.ndarray
    axes: np.ndarray

    def vectors(self, numbers: np.ndarray) -> np.ndarray:
        """Force vectors in the sensor frame from the numbers of a device, in the unit of the device.

        Parameters
        ----------
        numbers : ndarray, shape (N, 3)
            As the device sends them.

        Returns
        -------
        ndarray, shape (N, 3)
        """
        return np.einsum('nij,ni->nj', self.axes, numbers)


@dataclass(frozen=True)
class TaxelFrame:
    """One reading of all taxels.

    Parameters
    ----------
    positions, normals, forces : ndarray, shape (N, 3)
        Positions in m, unit normals out of the sensor, and forces of the object on the sensor, all in the sensor frame. Forces are in N, or
        in the unit of a device that is not calibrated.
    stamp_ns : int
        Time of sampling on the clock of the source, in ns.
    truth : TruthFrame or RecordedTruth, optional
        Ground truth of a simulated sensor, or of a recording that has it.
    """

    positions: np.ndarray
    normals: np.ndarray
    forces: np.ndarray
    stamp_ns: int
    truth: object = None

    @property
    def sizes(self) -> dict:
        """Empty: there is no image."""
        return {}


def tangents(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two tangents of each normal: the first is the x axis of the sensor frame, or its y axis where that is closer to the surface,
    projected on the surface; the second completes a right-handed frame.

    Parameters
    ----------
    normals : ndarray, shape (N, 3)
        Unit vectors.

    Returns
    -------
    tuple of ndarray, shape (N, 3)

    Examples
    --------
    >>> tangents(np.array([[0.0, 0.0, 1.0]]))
    (array([[1., 0., 0.]]), array([[0., 1., 0.]]))
    """
    along = np.where(np.abs(normals[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = along - np.einsum('nj,nj->n', along, normals)[:, None] * normals
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def taxel_frame(layout: TaxelLayout, numbers: np.ndarray, stamp_ns: int, label: str) -> TaxelFrame:
    """Make a frame of the numbers of a device.

    Parameters
    ----------
    layout : TaxelLayout
        Of the device.
    numbers : ndarray
        Three for each taxel, of any shape.
    stamp_ns : int
        Time of sampling, in ns.
    label : str
        Name of the frame in error messages.

    Returns
    -------
    TaxelFrame

    Raises
    ------
    BadFrame
        If their number is not that of the layout.
    """
    numbers = np.asarray(numbers, float)
    count = len(layout.positions)
    if numbers.size != 3 * count:
        raise BadFrame(f'{label} has {numbers.size} numbers; the layout has {count} taxels, which have {3 * count}; it is skipped')
    return TaxelFrame(layout.positions, layout.normals, layout.vectors(numbers.reshape(count, 3)), stamp_ns)


def read_layout(path: str | Path) -> TaxelLayout:
    """Read the layout file of a device.

    Parameters
    ----------
    path : str or Path
        YAML file with a list ``patches``, in the order in which the device sends their taxels. Each patch has either a list ``positions``
        (in m) and, where it is curved, ``normals``; or ``rows``, ``columns`` and ``pitch`` (in m), centred on the patch's origin, row by
        row. ``x_axes`` gives the direction of the first number of each taxel where it is not the x axis. ``translation`` (in m) and
        ``rotation`` (rotation vector, rad) are the pose of the patch in the sensor frame. ``signs`` are those of the three
        numbers for a force on the sensor along x axis, y axis and outward normal; the default is [1, 1, -1]: a press is positive.

    Returns
    -------
    TaxelLayout

    Raises
    ------
    BadArgument
        If the file is missing or not such a file.
    """
    try:
        page = yaml.safe_load(Path(path).read_text())
        parts = [_patch(patch) for patch in page['patches']]
        if not parts:
            raise ValueError('patches is empty')
    except BadArgument as error:
        raise BadArgument(f'layout: {path}: {error}') from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError, TypeError, KeyError, ValueError, AttributeError) as error:
        raise BadArgument(f'layout: {path} is no layout of taxels ({error!r}); docs/force_taxels.md describes the file') from None
    return TaxelLayout(*(np.concatenate(part) for part in zip(*parts)))


def _patch(patch: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, normals and axes of a patch. Raises BadArgument, ValueError or KeyError."""
    if 'positions' in patch:
        positions = _vectors(patch, 'positions')
    else:
        y, x = np.mgrid[:int(patch['rows']), :int(patch['columns'])].reshape(2, -1)
        middle = np.array([x.max(initial=0), y.max(initial=0)]) / 2
        positions = np.column_stack([(np.stack([x, y], 1) - middle) * float(patch['pitch']), np.zeros(len(x))])
    count = len(positions)
    if not count:
        raise BadArgument('a patch has no taxel')
    normals = _units(patch, 'normals', count) if 'normals' in patch else np.tile([0.0, 0.0, 1.0], (count, 1))
    first, second = tangents(normals)
    if 'x_axes' in patch:
        first = _units(patch, 'x_axes', count)
        first = first - np.einsum('nj,nj->n', first, normals)[:, None] * normals
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normals, first)
    signs = np.sign(np.asarray(patch.get('signs', (1, 1, -1)), float))
    if signs.shape != (3,) or not signs.all():
        raise BadArgument('signs has to be three numbers that are not 0')
    turn = _rotation(np.asarray(patch.get('rotation', (0, 0, 0)), float))
    axes = np.stack([first, second, normals], axis=1) * signs[:, None]
    found = positions @ turn.T + np.asarray(patch.get('translation', (0, 0, 0)), float), normals @ turn.T, axes @ turn.T
    if not all(np.isfinite(each).all() for each in found):
        raise BadArgument('a patch has a number that is not finite, or an x axis along its normal')
    return found


def _vectors(patch: dict, name: str) -> np.ndarray:
    values = np.asarray(patch[name], float)
    if values.ndim != 2 or values.shape[1] != 3:
        raise BadArgument(f'{name} has to be a list of three numbers a taxel')
    return values


def _units(patch: dict, name: str, count: int) -> np.ndarray:
    values = _vectors(patch, name)
    size = np.linalg.norm(values, axis=1, keepdims=True)
    if len(values) != count or not (size > FORCE_TAXEL_DRIVER.min_normal_length).all():
        raise BadArgument(f'{name} has to be {count} vectors that are not 0, one a taxel')
    return values / size


def _rotation(turn: np.ndarray) -> np.ndarray:
    """Matrix (3, 3) of a rotation vector, rad."""
    from scipy.spatial.transform import Rotation  # needed only for a layout file
    return Rotation.from_rotvec(turn).as_matrix()
