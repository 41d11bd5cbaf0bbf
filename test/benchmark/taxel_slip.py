# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip over time on real pressure matrices of a gripper's fingers: a line a pad.

python3 test/benchmark/taxel_slip.py FOLDER, the folder with sdh_slip/*.bag (ROS 1) and dsa_slip/*.npz (TACTILE_RECORDINGS). Only
the pitch of the pads is known; rows run along the finger.
"""
from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tactile_perception.common.estimates import NONE
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.estimator import TaxelEstimator, TaxelSettings
from tactile_perception.taxel.response import Response

PITCH, FULL_SCALE = 3.4e-3, 4095.0
_LEAST = 60  # counts: pads with a smaller maximum have no contact
_PAUSE_S = 0.5  # s between two slips


@dataclass(frozen=True)
class Pad:
    """One pad of a recording. t: (N,) s; values: (N, rows, columns)."""

    name: str
    t: np.ndarray
    values: np.ndarray


def read_bag(path: Path) -> Iterator[Pad]:
    """The pads of a ROS 1 bag with schunk_sdh/TactileSensor."""
    store, stamps, frames = get_typestore(Stores.ROS1_NOETIC), [], []
    with Reader(path) as reader:
        for connection in reader.connections:
            definition = getattr(connection.msgdef, 'data', connection.msgdef)
            store.register(get_types_from_msg(definition, connection.msgtype))
        for connection, _, data in reader.messages():
            message = store.deserialize_ros1(data, connection.msgtype)
            stamps.append(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)
            frames.append([np.array(m.tactile_array).reshape(m.cells_y, m.cells_x) for m in message.tactile_matrix])
    for number in range(len(frames[0])):
        yield Pad(f'{path.stem} pad {number}', np.array(stamps) - stamps[0], np.array([frame[number] for frame in frames]))


def read_npz(path: Path) -> Iterator[Pad]:
    """The pads of an .npz."""
    with np.load(path) as stored:
        t = 1e-3 * (stored['t_ms'] - stored['t_ms'][0])
        for name in stored.files:
            if stored[name].ndim == 3:
                yield Pad(f'{path.stem} {name}', t, stored[name])


def play(pad: Pad) -> tuple[np.ndarray, np.ndarray]:
    """States (N,) and velocities (N, 2) m/s of the slip of each frame; frames whose stamp repeats are passed over (state 0)."""
    shape = pad.values.shape[1:]
    response = Response(zero=np.zeros(shape, np.float32))  # in contact from the first frame
    estimator = TaxelEstimator(TaxelArray(*shape, PITCH, FULL_SCALE), SoftPad(), TaxelSettings(response=response))
    states, velocities = np.zeros(len(pad.t), int), np.full((len(pad.t), 2), np.nan)
    last = -1.0
    for k, (t, values) in enumerate(zip(pad.t, pad.values)):
        if t > last:
            slip = estimator.process(values, 1 + t).slip
            states[k], velocities[k], last = slip.state, slip.linear[:2], t
    return states, velocities


def events(t: np.ndarray, states: np.ndarray, velocities: np.ndarray) -> list[tuple[float, float, float]]:
    """(begin s, end s, largest speed along the finger m/s, with its sign) of each slip."""
    slipping, found = np.flatnonzero(states != NONE), []
    for group in np.split(slipping, np.flatnonzero(np.diff(t[slipping]) > _PAUSE_S) + 1) if len(slipping) else []:
        along = np.nan_to_num(velocities[group, 1])
        found.append((float(t[group[0]]), float(t[group[-1]]), float(along[np.argmax(np.abs(along))])))
    return found


def pads(folder: Path) -> Iterator[Pad]:
    """All pads of all recordings that feel anything."""
    for path in sorted(folder.glob('sdh_slip/*.bag')):
        yield from (pad for pad in read_bag(path) if pad.values.max() >= _LEAST)
    for path in sorted(folder.glob('dsa_slip/*.npz')):
        yield from (pad for pad in read_npz(path) if pad.values.max() >= _LEAST)


def main() -> int:
    """Print a line a pad."""
    for pad in pads(Path(sys.argv[1])):
        states, velocities = play(pad)
        found = [f'{begin:.2f}-{end:.2f} s {1e3 * speed:+.1f} mm/s' for begin, end, speed in events(pad.t, states, velocities)]
        more = f' and {len(found) - 6} more' if len(found) > 6 else ''
        print(f'{pad.name}: {len(pad.t)} frames, {np.mean(states > 0):.1%} slip; {"; ".join(found[:6]) or "quiet"}{more}', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
