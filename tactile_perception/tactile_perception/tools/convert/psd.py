# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the recording of a PSD finger: a folder with meta.json, input.npz (t, volts; label_phi, label_theta of a stage), truth.npz."""
from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message
from tactile_driver.nodes.streams.voltage import instants, voltages_message
from tactile_driver.samples import SampleBlock
from tactile_driver.simulation.truth import Touch

from ...errors import BadRecording

_BLOCK_S = 0.005  # duration of one message, the default of psd_node
_CONTACT = 2  # value of phase in truth.npz
_FIRST_S = 1.0  # chosen: much of ROS takes a stamp of zero for an unknown time


class PsdRecording:
    """A recording folder. Raises BadRecording for a missing or damaged file.

    path: the folder. The ground truth position of a press is the label of the stage where there is one, otherwise the true position.
    """

    def __init__(self, folder: str | Path):
        self.path = Path(folder)
        try:
            self.meta = json.loads((self.path / 'meta.json').read_text())
            self._input, self._truth = (dict(np.load(self.path / name)) for name in ('input.npz', 'truth.npz'))
            self.volts, self._t = self._input['volts'].astype(np.float32), self._input['t']
        except (OSError, ValueError, KeyError, BadZipFile) as error:
            raise BadRecording(f'recording {self.path}: {error!r}') from error
        self.period = float(np.median(np.diff(self._t)))

    def __len__(self) -> int:
        return len(self.volts)

    def messages(self, frame_id: str) -> Iterator[tuple[int, str, object]]:
        """Yield (stamp in ns, topic, message) in order: blocks of voltages, each followed by the ground truth at its first sample and at
        samples where contacts begin or end.
        """
        numbers, count = TouchNumbers(), max(round(_BLOCK_S / self.period), 1)
        normals, touching = self._normals(), self._truth['n_contacts'] * (self._truth['phase'] == _CONTACT)
        for begin in range(0, len(self), count):
            block = SampleBlock(self.volts[begin:begin + count], self._stamp(begin), self.period)
            yield block.stamp_ns, 'voltages', voltages_message(block, frame_id)
            for k in (begin + np.array(instants(touching[begin:begin + count]))).tolist():
                touches = self._touches(k, normals[k])
                yield self._stamp(k), 'ground_truth/contacts', contacts_message(touches, numbers.assign(touches),
                                                                                 header_of(self._stamp(k), frame_id))

    def _stamp(self, k: int) -> int:
        return round((float(self._t[k]) + _FIRST_S) * 1e9)

    def _touches(self, k: int, normal: np.ndarray) -> list[Touch]:
        if self._truth['phase'][k] != _CONTACT:
            return []
        radius, depth = float(self.meta['R_s_m']), 1e-3 * float(self._truth['indentation_mm'][k])
        touch = Touch(radius * normal, normal, depth, float(self._truth['force_N'][k]))
        return [touch] * int(self._truth['n_contacts'][k])

    def _normals(self) -> np.ndarray:
        """Unit normals (N, 3); those of the label during each labelled press."""
        normals = np.array(self._truth['normal'], float)
        labels = self._input.get('label_theta')
        if labels is None:
            return normals
        edges = np.flatnonzero(np.diff(np.r_[False, self._truth['phase'] == _CONTACT, False].astype(np.int8)))
        for begin, end in zip(edges[::2], edges[1::2]):
            known = np.flatnonzero(np.isfinite(labels[begin:end]))
            if len(known):
                phi, theta = (float(self._input[name][begin + known[0]]) for name in ('label_phi', 'label_theta'))
                normals[begin:end] = np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)
        return normals

    def parameters(self) -> dict[str, object]:
        """Name -> value of the parameters that meta.json contains."""
        return {'sensor_type': self.meta['sensor'], 'radius': float(self.meta['R_s_m'])}

    def frames(self) -> dict[str, float]:
        """z in the sensor frame, m, of the sensor's own frames, by name."""
        return {'tip': float(self.meta['R_s_m'])}
