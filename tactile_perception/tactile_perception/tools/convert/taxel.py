# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the recording of a taxel array: a folder (meta.json, input.npz with t and frames, truth.npz) or an .npz of imprints under known
weights."""
from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import cv2
import numpy as np

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message, static_transform
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, recorded_truth
from tactile_driver.simulation.truth import Touch, TruthFrame
from tactile_driver.sources.source import FIRST_S

from ...core.errors import BadRecording
from .camera import KNOWN, read_arrays


class _Row(NamedTuple):
    """One frame: values (rows, columns), stamp (s), and ground truth, None when unknown."""

    values: np.ndarray
    stamp: float
    truth: TruthFrame | None


class TaxelRecording:
    """A folder or file at path. Raises BadRecording when something is missing or damaged."""

    def __init__(self, path: str | Path):
        self.path, self.meta = Path(path), {}
        try:
            self._rows = _imprints(read_arrays(self.path)) if self.path.suffix == '.npz' else self._folder()
        except (OSError, ValueError, KeyError, TypeError, BadZipFile) as error:
            raise BadRecording(f'recording {self.path}: {error!r}') from error
        if not self._rows:
            raise BadRecording(f'recording {self.path}: input.npz has no frames')

    def __len__(self) -> int:
        return len(self._rows)

    def messages(self, frame_id: str) -> Iterator[tuple[int, str, object]]:
        """Yield (stamp in ns, topic, message) in order; each frame is followed by its ground truth."""
        numbers, last = TouchNumbers(), None
        shift = FIRST_S if self._rows[0].stamp < FIRST_S else 0.0
        for row in self._rows:
            stamp_ns = round((row.stamp + shift) * 1e9)
            header = header_of(stamp_ns, frame_id)
            encoding = 'mono8' if row.values.dtype == np.uint8 else 'mono16'
            yield stamp_ns, 'image_raw', image_to_message(Frame(row.values, stamp_ns, encoding), '', header)
            if row.truth is not None:
                yield from recorded_truth(row.truth, numbers, row.stamp - (last or row.stamp), header, KNOWN)
            last = row.stamp

    def parameters(self) -> dict[str, object]:
        """Name -> value of the parameters that the recording contains."""
        rows, columns = (int(n) for n in self._rows[0].values.shape)
        largest = max(int(row.values.max()) for row in self._rows)
        found = {'sensor_type': 'taxel_array', 'rows': rows, 'columns': columns, 'pitch': 3.4e-3,
                 'bits': 8 if self._rows[0].values.dtype == np.uint8 else max(12, largest.bit_length())}
        if self.path.suffix == '.npz':
            return found
        names = {'pitch': 'pitch_m', 'bits': 'bits', 'pad.thickness': 'pad_thickness_m', 'pad.stiffness': 'pad_E_Pa',
                 'pad.shear_modulus': 'pad_G_Pa', 'pad.friction': 'mu_nominal'}
        return found | {name: self.meta[key] for name, key in names.items() if key in self.meta}

    def transforms(self, frame_id: str) -> list:
        """TransformStamped of the taxels in the sensor frame, where the pad's thickness is known."""
        below = [float(self.meta[name]) for name in ('pad_thickness_m',) if name in self.meta]
        return [static_transform(frame_id, f'{frame_id}_taxels', (0.0, 0.0, -thickness)) for thickness in below]

    def _folder(self) -> list[_Row]:
        self.meta = json.loads((self.path / 'meta.json').read_text())
        found, truth = (read_arrays(self.path / name) for name in ('input.npz', 'truth.npz'))
        return [_Row(np.ascontiguousarray(values), float(stamp), _truth({name: v[k] for name, v in truth.items()}, self.meta['pitch_m']))
                for k, (values, stamp) in enumerate(zip(found['frames'], found['t']))]


def _truth(of: dict, pitch: float) -> TruthFrame:
    """Ground truth of a frame; of: its arrays in truth.npz; pitch: m. Unknown values are NaN."""
    touched = bool(of['contact'])
    centroid = np.array([*(1e-3 * np.asarray(of['centroid_mm'], float)), 0.0])
    normal = float(of['Fn_N'])
    x, y = 1e-3 * np.nan_to_num(np.asarray(of['cop_mm'], float))
    along = np.asarray(of['Ft_N'], float)
    wrench = np.array([*along, -normal, -y * normal, x * normal, x * along[1] - y * along[0] + 1e-3 * float(of['Mz_cop_Nmm'])])
    frame = TruthFrame(area=float(of['area_m2']), slip_state=int(of['slip_state']), slipping_fraction=float(of['slip_fraction']),
                       wrench=wrench)
    if touched:
        frame.outlines, frame.holes = _loops(np.asarray(of['contact_fraction'], np.float32), pitch)
        depth = 1e-3 * float(of['depth_mm']) or np.nan  # 0 means unknown
        frame.centroid, frame.normal = centroid, np.array([0.0, 0.0, 1.0])
        frame.contacts = [Touch(centroid + [0, 0, -np.nan_to_num(depth)], frame.normal, depth, normal)]
    return frame


def _loops(fraction: np.ndarray, pitch: float) -> tuple[list, list]:
    """Outlines and holes, (M, 3) m each, of the contact region; fraction: (rows, columns) float32, touched share of each taxel."""
    padded = cv2.copyMakeBorder(fraction, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    steps = 16  # subdivisions of a taxel
    fine = cv2.resize(padded, None, fx=steps, fy=steps, interpolation=cv2.INTER_LINEAR)
    loops, families = cv2.findContours((fine >= 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_TC89_L1)
    vertices = [pitch * ((loop.reshape(-1, 2) + 0.5) / steps - 0.5 * np.array(padded.shape[::-1])) for loop in loops]
    whole = [(np.column_stack([xy, np.zeros(len(xy))]), family[3] >= 0) for xy, family in zip(vertices, families[0])] if vertices else []
    return [loop for loop, hole in whole if not hole], [loop for loop, hole in whole if hole]


def _imprints(arrays: dict[str, np.ndarray]) -> list[_Row]:
    """Frames of all imprints in sequence, with ground truth once the weight has settled.

    The name of an array is a letter for the weight and a number. The whole weight is on the array where the sum is above 80 % of its 90th
    percentile, and has settled after half of that time.
    """
    rows, clock, grams = [], 0.0, {letter: 200 + 100 * k for k, letter in enumerate('ABCDEFGH')}
    for name in sorted(key for key in arrays if key[0] in grams and key[1:].isdigit()):
        values, times = arrays[name], 1e-3 * (arrays[f'{name}_t_ms'] - arrays[f'{name}_t_ms'][0])
        total = values.sum(axis=(1, 2), dtype=float)
        standing = np.flatnonzero(total > 0.8 * np.percentile(total, 90))
        settled = set(standing[int(0.5 * len(standing)):].tolist())
        force = 1e-3 * grams[name[0]] * 9.81
        known = TruthFrame(area=1.1025e-4, contacts=[Touch(np.full(3, np.nan), np.array([0.0, 0.0, 1.0]), np.nan, force)],
                           wrench=np.array([np.nan, np.nan, -force, np.nan, np.nan, np.nan]))
        rows += [_Row(np.ascontiguousarray(v), clock + float(t), known if k in settled else None)
                 for k, (v, t) in enumerate(zip(values, times))]
        clock = rows[-1].stamp + 1.0  # s, pause between imprints
    return rows
