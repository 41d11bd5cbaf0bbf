# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of taxels that measure forces."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class ForceTaxelConstants:
    """Priors of offsets, noise and touches, and limits of what determines a calibration."""

    reference_s: float = constant(1.0, 's', 'prior', 'over which offset and noise are measured first')
    range: float = constant(100.0, 'sigma', 'prior', 'scale of a force that is measured, in standard deviations of noise')
    rate: float = constant(0.5, '1/s', 'prior', 'touches that begin and touches that end: a hand at work')
    late: float = constant(0.02, '1', 'physical', 'part of a force that silicone rubber shows late or keeps for a while, after a second')
    drift: float = constant(0.1, '1/s', 'prior', 'noise variances: least first guess of the drift, which then follows the innovations')
    drift_range: tuple[float, float] = constant((1e-6, 1e2), '1/s', 'limit', 'the same: its limits')
    adapts_s: float = constant(0.5, 's', 'prior', 'over which the drift follows the innovations')
    noise_s: float = constant(3.0, 's', 'prior', 'over which the noise follows the differences between frames')
    max_evidence: float = constant(50.0, 'nat', 'numeric', 'for or against a touch, of a frame and of all: avoids overflow')
    unusual: float = constant(8.0, 'sigma', 'limit', 'of the log noise, from which a taxel is dead')
    usual_spread: float = constant(0.25, '1', 'prior', 'least standard deviation of that log over healthy taxels')
    usual_error: float = constant(0.05, '1', 'prior',
                                  'relative, of a taxel of a sensor that its maker has calibrated: data sheets say 2 to 10 %')
    near: float = constant(1.6, 'pitch', 'limit', 'within which taxels are neighbours: across the diagonal of a square, too')
    same_side: float = constant(0.3, '1', 'limit',
                                'cosine between the normals of neighbours: those of a patch, not of two sides of a finger')
    alone: float = constant(0.005, 'm', 'physical', 'pitch of a single taxel: as on the hands that bear them')
    middle: tuple[float, float] = constant((0.25, 0.9), '1', 'limit',
        'part of a load whose readings are taken: after what an elastomer shows late, and before the end')
    equal: float = constant(0.02, '1', 'limit', 'relative difference between equal forces')
    min_force: float = constant(0.02, 'N', 'limit', 'of a load')
    min_frames: int = constant(5, '1', 'limit', 'of a load')


FORCE_TAXEL = ForceTaxelConstants()
