# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors and time of the gel's estimator on simulated gels that it was not made with: python3 test/benchmark/gels.py [GELS]."""
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'tactile_perception' / 'test' / 'helpers'))
from pressed_gel import CENTRE, FOCAL, pressed_gel  # noqa: E402  after the path

from tactile_perception.layer.estimator import GelEstimator  # noqa: E402

#: What differs from a gel with a grid of 1.5 mm and a noise of 0.05 px, and from what its user measured (factors).
ROWS = {'grid, 1.5 mm': ({}, 0.05, {}), 'at random': ({'grid': False}, 0.05, {}), '0.75 mm': ({'pitch': 0.75e-3}, 0.05, {}),
        '3 mm': ({'pitch': 3e-3}, 0.05, {}), 'noise 0.15 px': ({}, 0.15, {}), 'stamp, 4 x 2.4 mm': ({'half': (2e-3, 1.2e-3)}, 0.05, {}),
        'thickness 10 % off': ({}, 0.05, {'gel.thickness': 1.1}),
        'Poisson 0.49 for 0.47': ({'poisson': 0.47}, 0.05, {'gel.poisson_ratio': 0.49 / 0.47}),
        'camera not calibrated': ({}, 0.05, {'focal': 0.0})}


def trial(seed, changes, noise, factors):
    """Errors of the middle (mm), of normal and of shear force (%), of depth and of area (%), and processor time (ms)."""
    rng = np.random.default_rng([seed, 40])
    angle, length, thickness = rng.uniform(0, 2 * np.pi), rng.uniform(0.2e-3, 0.7e-3), rng.uniform(3e-3, 6e-3)
    given = {'thickness': thickness, 'poisson': rng.uniform(0.46, 0.49), 'radius': rng.uniform(4e-3, 9e-3),
             'friction': rng.uniform(0.2, 0.9), 'depth': rng.uniform(0.1, 0.2) * thickness, 'middle': rng.uniform(-2.5e-3, 2.5e-3, 2),
             'displacement': (length * np.cos(angle), length * np.sin(angle))}
    gel = pressed_gel(rng, **given | changes)
    parameters = {name: value * factors.get(name, 1.0) for name, value in gel.parameters.items()}
    estimator = GelEstimator(parameters, CENTRE, FOCAL * factors.get('focal', 1.0))
    for frame in range(10):
        estimator.process(gel.tracks(None, rng, noise), 0.04 * frame)
    for k, state in enumerate(gel.states):
        tracks, true = gel.tracks(state, rng, noise), state.force.sum(axis=0)
        begin = time.process_time()
        result = estimator.process(tracks, 1.0 + k)
        taken = time.process_time() - begin
        if k:  # the first one fills tables
            position = state.positions.mean(axis=0) + state.shift if gel.contact.indenter.radius == 0 else state.middle
            depth = 100 * (result.contacts[0].depth / state.depth - 1)
            area = 100 * (result.region.area / (len(state.positions) * gel.contact.cell**2) - 1)
            off = 100 * (result.wrench[:3] - true) / -true[2]
            yield 1e3 * np.hypot(*(result.region.centroid[:2] - position)), off[2], np.hypot(*off[:2]), depth, area, 1e3 * taken


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    heads = ''.join(f'{name:>10}{"largest":>8}' for name in ('middle mm', 'normal %', 'shear %', 'depth %', 'area %'))
    print(f'{"gel":22}{heads}{"ms":>6}')
    for name, what in ROWS.items():
        found = np.abs([row for seed in range(count) for row in trial(seed, *what)])
        known = found[:, np.isfinite(found).any(axis=0)]
        reported = ''.join(f'{np.nanmedian(k):10.2f}{np.nanmax(k):8.2f}' if np.isfinite(k).any() else f'{"-":>10}{"-":>8}'
                           for k in found.T[:5])
        print(f'{name:22}{reported}{np.median(known[:, -1]):6.0f}')


if __name__ == '__main__':
    main()
