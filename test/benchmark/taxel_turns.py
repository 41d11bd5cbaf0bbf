# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The methods of a taxel array, and plain optical flow, alternating on every frame of a bag with ground truth."""
from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tactile_perception.bags.stamped import TRUE_WRENCH, TRUTH, pairs_of
from tactile_perception.evaluation.evaluation import Evaluation
from tactile_perception.evaluation.frames import Instant
from tactile_perception.nodes.messages import conversions as convert
from tactile_perception.nodes.messages.estimates import contacts_from_message, region_from_message, slip_from_message, wrench_from_message
from tactile_perception.parameters.file import read_parameters
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS, taxel_estimator
from tactile_perception.taxel.estimator import TAXEL_METHODS

from lucas_kanade import LucasKanade

FLOW = 'Lucas-Kanade'
_WANTED = ('image_raw', TRUTH, 'ground_truth/contact_region', 'ground_truth/slip')


@dataclass
class Turns:
    """What one method has made of all frames so far."""

    evaluation: Evaluation = field(default_factory=Evaluation)
    seconds: list[float] = field(default_factory=list)

    def row(self) -> dict[str, float]:
        """Errors by name: 1 - F1 of slip states, per cent of area not shared, mm/s, per cent of force."""
        report = self.evaluation.summary()
        middle = {name: found['median'] for name, found in report['errors'].items()}
        return {'slip states': 1 - report['slip_states']['macro_f1'], 'region overlap': 1 - middle.get('region_overlap', np.nan),
                'slip velocity': middle.get('slip_velocity', np.nan), 'force': middle.get('force_relative', np.nan)}


def frames(bag: Path):
    """(stamp s, values (rows, columns), truth) of each frame."""
    for _, found in pairs_of(bag, '', _WANTED, lambda _: None):
        message = found['image_raw']
        values = np.frombuffer(bytes(message.data), np.uint8 if message.encoding == 'mono8' else np.uint16)
        wrench = found.get(TRUE_WRENCH)
        true = Instant(contacts_from_message(found[TRUTH]), region_from_message(found['ground_truth/contact_region']),
                       slip_from_message(found['ground_truth/slip']), wrench and wrench_from_message(wrench))
        yield convert.stamp_seconds(message.header), values.reshape(message.height, message.width), true


def run(bags: list[Path], parameters: Path, calibration: Path) -> dict[str, Turns]:
    """All methods on all bags; each begins anew with each bag."""
    values = read_parameters(parameters, 'taxel_contact_node', TAXEL_PARAMETERS) | {'calibration': str(calibration)}
    turns = {name: Turns() for name in (*TAXEL_METHODS, FLOW)}
    for bag in bags:
        estimators = {name: taxel_estimator(values | {'method': name}) for name in TAXEL_METHODS}
        estimators[FLOW] = LucasKanade(values['pitch'])
        for number, (stamp, image, true) in enumerate(frames(bag)):
            for name in np.roll(list(estimators), number).tolist():
                begin = time.thread_time()
                result = estimators[name].process(image, stamp)
                turns[name].seconds.append(time.thread_time() - begin)
                turns[name].evaluation.add(stamp, _told(name, result), true)
    return turns


def _told(name: str, result) -> Instant:
    return Instant(slip=result) if name == FLOW else Instant(result.contacts, result.region, result.slip, result.wrench)
