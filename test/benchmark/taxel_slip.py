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
from tactile_perception.taxel.estimator import TaxelEstimator, TaxelSettings
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.response import Response

PITCH, FULL_SCALE = 3.4e-3, 4095.0
_MIN_COUNTS = 60  # counts: pads with a smaller maximum have no contact
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


def events(pad: Pad) -> tuple[list[tuple[float, float, float]], float]:
    """(begin s, end s, largest speed along the finger m/s, with its sign) of each slip, and the share of frames with slip; frames whose
    stamp repeats are passed over."""
    shape = pad.values.shape[1:]
    response = Response(zero=np.zeros(shape, np.float32))  # in contact from the first frame
    estimator = TaxelEstimator(TaxelArray(*shape, PITCH, FULL_SCALE), SoftPad(), TaxelSettings(response=response))
    found, last, slipping = [], -1.0, 0
    for t, values in zip(pad.t.tolist(), pad.values):
        if t <= last:
            continue
        slip, last = estimator.process(values, 1 + t).slip, t
        if slip.state != NONE:
            slipping, speed = slipping + 1, float(np.nan_to_num(slip.linear[1]))
            begin, end, largest = found.pop() if found and t - found[-1][1] <= _PAUSE_S else (t, t, 0.0)
            found.append((begin, t, max(largest, speed, key=abs)))
    return found, slipping / len(pad.t)


def pads(folder: Path) -> Iterator[Pad]:
    """All pads of all recordings that feel anything."""
    for path in sorted(folder.glob('sdh_slip/*.bag')):
        yield from (pad for pad in read_bag(path) if pad.values.max() >= _MIN_COUNTS)
    for path in sorted(folder.glob('dsa_slip/*.npz')):
        yield from (pad for pad in read_npz(path) if pad.values.max() >= _MIN_COUNTS)


def main() -> None:
    """Print a line a pad."""
    for pad in pads(Path(sys.argv[1])):
        found, share = events(pad)
        said = [f'{begin:.2f}-{end:.2f} s {1e3 * speed:+.1f} mm/s' for begin, end, speed in found]
        more = f' and {len(found) - 6} more' if len(found) > 6 else ''
        print(f'{pad.name}: {len(pad.t)} frames, {share:.1%} slip; {"; ".join(said[:6]) or "quiet"}{more}', flush=True)


if __name__ == '__main__':
    main()
