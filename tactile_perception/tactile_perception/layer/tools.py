# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Known loads in recordings, and the modulus that they give."""
from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from ..bags.stamped import TRUE_WRENCH, find_prefix
from ..common.progress import progress
from ..core.errors import BadCalibration, BadFrame
from ..core.stage import Stage
from .constants import LAYER


class Load(NamedTuple):
    """A known load and what the estimator makes of it. newtons: the load; unit_force: N, the estimated force for a modulus of 1 Pa; sigma:
    relative standard deviation of the latter."""

    newtons: float
    unit_force: float
    sigma: float


class FittedModulus(NamedTuple):
    """value: Pa; force_sigma: relative standard deviation of a force; scatter: that of the moduli that the loads give."""

    value: float
    force_sigma: float
    scatter: float


def fit_modulus(loads: list[Load]) -> FittedModulus:
    """The modulus that known loads give.

    Notes
    -----
    Force is proportional to the modulus. Each load therefore gives an estimate of it: the load over the force that is estimated for a
    modulus of 1 Pa. The result is their geometric mean. The relative standard deviation of a force is the scatter of these estimates, or
    the median of what the estimator states, whichever is larger.
    """
    logs = np.log([load.newtons / load.unit_force for load in loads])
    scatter = float(np.std(logs, ddof=1)) if len(logs) > 1 else 0.0
    return FittedModulus(float(np.exp(logs.mean())), max(scatter, float(np.median([load.sigma for load in loads]))), scatter)


def load_report(loads: list[Load], fit: FittedModulus, name: str, left_out: list[str], output: Path) -> str:
    """Report of a calibration by known loads. name: of the modulus; left_out: frames that are not used; output: the file."""
    return '\n'.join([
        f'{len(loads)} loads',
        *(f'{load.newtons:.3g} N: {fit.value * load.unit_force:.3g} N with this calibration' for load in loads),
        f'{name} {fit.value:.4g} Pa; the standard deviation of a force is {fit.force_sigma:.1%} of it',
        *(f'left out: {line}' for line in left_out), f'written: {output}'])


def read_loads(bags: list[Path], new_stage: Callable[[], Stage], sigma_of: Callable[[float, Stage], float], namespace: str,
               weight: float | None, left_out: list[str]) -> list[Load]:
    """The loads of recordings: frames with the same load, to two digits, are one.

    Parameters
    ----------
    bags : list of Path
        Recordings. Each begins with the untouched gel.
    new_stage : callable
        Makes a stage whose modulus is 1 Pa.
    sigma_of : callable
        Standard deviation in N of a pressing force in N that a stage has just estimated.
    namespace : str
        Of the sensor in the recordings.
    weight : float or None
        Force in N that presses in each recording; None: the recordings contain `ground_truth/wrench`.
    left_out : list of str
        Frames that are not used are appended.

    Raises
    ------
    BadCalibration
        If a recording contains no press with a known load, or the weight is not above 0.
    """
    if weight is not None and not 0 < weight < np.inf:
        raise BadCalibration(f'--weight {weight:g}: the force of the weight in N must be above 0; 1 kg is 9.81 N')
    return [load for bag in bags for load in _loads_of(bag, new_stage(), sigma_of, namespace, weight, left_out)]


def _loads_of(bag: Path, stage: Stage, sigma_of: Callable, namespace: str, weight: float | None, left_out: list[str]) -> list[Load]:
    """The loads of a recording."""
    groups = defaultdict(list)
    frames = list(_pressed_frames(bag, stage, sigma_of, namespace, left_out, weight is None))
    if weight is not None:  # the weight is at rest in the later half
        frames = [frame._replace(newtons=weight) for frame in frames[len(frames) // 2:]]
    for frame in frames:
        if frame.newtons > 0:
            groups[f'{frame.newtons:.1e}'].append(frame)
    loads = [Load(*np.median(group, axis=0)) for group in groups.values() if len(group) >= LAYER.min_frames]
    if not loads:
        raise BadCalibration(f'{bag}: fewer than {LAYER.min_frames} images show a press with a known force; record the untouched gel for a '
                             'second, then a ball on the gel with the weight on the ball'
                             + (f'; last problem: {left_out[-1]}' if left_out else ''))
    return loads


def _pressed_frames(bag: Path, stage: Stage, sigma_of: Callable, namespace: str, left_out: list[str], is_measured: bool) -> Iterator[Load]:
    """The frames of a recording that show a press; newtons: NaN where ground_truth/wrench has no message of the image's stamp. is_measured:
    whether ground_truth/wrench is required."""
    newtons, estimates = {}, {}
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace)
        if is_measured and prefix + TRUE_WRENCH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUE_WRENCH}; give the force of the weight in N by --weight')
        wanted = {prefix + name for name in ('image_raw', 'camera_info', TRUE_WRENCH)}
        for raw in progress(reader.messages(wanted), f'messages of {bag.name}'):
            topic, message = raw.topic.removeprefix(prefix), decode(raw.data, raw.type_name)
            stamp = stamp_ns_of(message.header)
            try:
                if topic == 'camera_info':
                    stage.take(topic, message)
                elif topic == TRUE_WRENCH:
                    newtons[stamp] = -message.wrench.force.z
                else:
                    force = -stage.process(message, ['wrench'])['wrench'][0].wrench.force.z
                    estimates[stamp] = force, sigma_of(force, stage)
            except BadFrame as error:
                left_out.append(f'{bag.name} at {1e-9 * stamp:.2f} s: {error}')
    for stamp, (force, sigma) in estimates.items():
        if force > 0:
            yield Load(newtons.get(stamp, np.nan), force, sigma / force)
