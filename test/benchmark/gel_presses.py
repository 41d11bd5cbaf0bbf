# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts of a gel compared with known presses, as a table and a figure: simulated presses, or labelled photographs.

    python3 test/benchmark/gel_presses.py [--figure FIGURE.webp]
    python3 test/benchmark/gel_presses.py --photographs FOLDER --pitch 2.05 [--figure FIGURE.webp]

FOLDER is a calibration folder as gs_sdk (Joe Huang) writes it: background.png, and folders DIAMETERmm/NUMBER with gelsight.png and
label.npz, which contains center and radius in px of the circle in which a ball touches the gel.
"""
import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from tactile_driver.parameters.table import defaults
from tactile_perception.common.dots import DotTracks
from tactile_perception.core.errors import BadFrame
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.gel.parameters import GEL_PARAMETERS
from tactile_perception.layer.estimator import GelEstimator

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'tactile_perception' / 'test' / 'helpers'))
from pressed_gel import CENTRE, FOCAL, METRES, pressed_gel  # noqa: E402  after the path

UNTOUCHED_FRAMES, PRESSED_FRAMES, PERIOD_S = 10, 3, 0.04  # of each press; s from one frame to the next
DRAWN_PRESSES, DRAWN_GAIN = 8, 5  # in the figure; displacements are drawn so many times as long


@dataclass
class Press:
    """A known press and what the estimator makes of it. centre, radius: px, known circle of contact; depth: m, NaN if not known."""

    centre: np.ndarray
    radius: float
    depth: float = np.nan
    tracks: DotTracks | None = None
    outlines: list = field(default_factory=list)
    errors: list = field(default_factory=list)

    def judge(self, estimator, untouched, pressed):
        """Estimate a still press after untouched frames and before another. Raises BadFrame.

        errors: number of contacts, error of the position in pitches, squared over the stated one, area over the known one, depth over the
        known one, state of slip, number of false contacts.
        """
        frames = [untouched] * UNTOUCHED_FRAMES + [pressed] * PRESSED_FRAMES + [untouched]
        results = [estimator.process(frame, PERIOD_S * number) for number, frame in enumerate(frames)]
        result, false = results[-2], sum(len(other.contacts) for other in (*results[:UNTOUCHED_FRAMES], results[-1]))
        self.tracks, self.outlines = pressed, [estimator.to_image(line[:, :2]) for line in result.region.outlines]
        self.errors = [len(result.contacts), np.nan, np.nan, np.nan, np.nan, result.slip.state, false]
        if result.contacts:
            contact, metres = result.contacts[0], estimator.metres
            error = metres * np.hypot(*(estimator.to_image(contact.position[None, :2])[0] - self.centre))
            area = cv2.contourArea(np.float32(self.outlines[0])) / (np.pi * self.radius**2)
            self.errors[1:5] = [error / estimator.pitch, error**2 / np.trace(contact.position_covariance[:2, :2]), area,
                                contact.depth / self.depth]


def photographs(folder, pitch, thickness):
    """The labelled photographs of a folder, judged."""
    values = {**defaults(GEL_PARAMETERS), 'gel.pitch': pitch, 'gel.thickness': thickness, 'gel.friction': 0.5}
    background, presses = cv2.imread(str(folder / 'background.png')), []
    for label in [] if background is None else sorted(folder.glob('*mm/*/label.npz')):
        known = np.load(label)
        tracker = make_tracker(values, image_only=True)
        estimator = GelEstimator(values, (np.array(background.shape[1::-1]) - 1) / 2)
        press = Press(known['center'].astype(float), float(known['radius']))
        try:
            for number in range(UNTOUCHED_FRAMES):
                untouched = tracker.process(background, PERIOD_S * number)
            photograph = cv2.imread(str(label.parent / 'gelsight.png'))
            press.judge(estimator, untouched, tracker.process(photograph, PERIOD_S * UNTOUCHED_FRAMES))
        except BadFrame as error:
            print(f'{label.parent}: refused: {error}')
            continue
        presses.append(press)
    return presses


def simulated(count):
    """Simulated presses of balls of 2.5 to 9 mm radius, judged: (by what is known of a gel that was measured; with its thickness and the
    camera unknown; with the depth of its dots unknown, too)."""
    unknown = {'gel.thickness': 0.0}
    settings = ({}, FOCAL), (unknown, 0.0), (unknown | {'gel.dot_depth': 0.0}, 0.0)
    presses = [], [], []
    for seed in range(count):
        rng = np.random.default_rng([seed, 53])
        small = seed % 2 == 0
        angle, drag, thickness = rng.uniform(0, 2 * np.pi), rng.uniform(0.05e-3, 0.5e-3), rng.uniform(3e-3, 6e-3)
        gel = pressed_gel(rng, pitch=2e-3 if small else 1.5e-3, thickness=thickness, radius=2.5e-3 if small else rng.uniform(4e-3, 9e-3),
                          depth=rng.uniform(0.1, 0.2) * thickness, friction=rng.uniform(0.3, 0.9), middle=rng.uniform(-3e-3, 3e-3, 2),
                          displacement=(drag * np.cos(angle), drag * np.sin(angle)))
        state, untouched, tracks = gel.states[-1], gel.tracks(None, rng), gel.tracks(gel.states[-1], rng)
        radius = np.sqrt(len(state.positions) / np.pi) * gel.contact.cell / METRES
        for found, (changes, focal) in zip(presses, settings):
            press = Press(state.middle / METRES + CENTRE, radius, state.depth)
            press.judge(GelEstimator(gel.parameters | changes, CENTRE, focal), untouched, tracks)
            found.append(press)
    return presses


def report(name, presses):
    """Print the row of the table."""
    table = np.array([press.errors for press in presses])
    contacts, error, squared, area, depth, slip, false = table.T
    known = np.isfinite(error)
    worst = np.maximum(area, 1 / area)[known]
    deep = f'{np.median(depth[known]):.2f}; {np.mean(np.abs(depth[known] - 1) < 0.25):.0%}' if np.isfinite(depth).any() else 'NaN'
    print(f'| {name} | {len(table)} | {np.mean(contacts == 1):.0%} | {np.median(error[known]):.2f}, {np.percentile(error[known], 95):.2f} '
          f'| {np.mean(squared[known]):.2f} ({np.median(squared[known]):.2f}) | {np.median(area[known]):.2f}; {np.mean(worst < 1.5):.0%} '
          f'| {deep} | {np.mean(slip > 0):.0%} | {np.mean(false > 0):.0%} |')


def draw(presses, path):
    """Dots, displacements, known circle and estimated contact of each press."""
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(2, 4, figsize=(12, 5))
    for axis, press in zip(axes.flat, presses):
        tracks = press.tracks
        axis.quiver(*tracks.rest_uv.T, *tracks.duv.T, angles='xy', scale_units='xy', scale=1 / DRAWN_GAIN, width=0.004)
        axis.plot(*tracks.uv.T, 'k.', markersize=3)
        axis.add_patch(plt.Circle(tuple(press.centre), press.radius, fill=False, color='tab:blue', linestyle='--'))
        for outline in press.outlines:
            axis.plot(*np.vstack([outline, outline[:1]]).T, color='tab:red')
        axis.set(aspect='equal', xticks=[], yticks=[])
        axis.invert_yaxis()
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--photographs', type=Path, metavar='FOLDER')
    parser.add_argument('--pitch', type=float, default=2.0, help='photographs: distance of neighbouring dots, mm')
    parser.add_argument('--thickness', type=float, default=0.0, help='photographs: thickness of the gel, mm; 0: not known')
    parser.add_argument('--presses', type=int, default=24, help='number of simulated presses')
    parser.add_argument('--figure', type=Path, help='image file to write')
    given = parser.parse_args()
    if given.photographs:
        rows = {'photographs': photographs(given.photographs, 1e-3 * given.pitch, 1e-3 * given.thickness)}
    else:
        names = 'simulated, all measured', 'simulated, thickness and camera not known', 'simulated, depth of dots not known either'
        rows = dict(zip(names, simulated(given.presses)))
    if not all(rows.values()):
        sys.exit('no press: FOLDER must contain background.png and DIAMETERmm/NUMBER/label.npz')
    print('| presses | number | one contact | error of position, pitches: median, 95 % | its square over the stated one: mean (median) | '
          'area over the known one: median; within a factor of 1.5 | depth over the known one: median; within 25 % | slip reported | '
          'false contacts |\n' + '|---' * 9 + '|')
    for name, presses in rows.items():
        report(name, presses)
    if given.figure:
        draw(next(iter(rows.values()))[:DRAWN_PRESSES], given.figure)


if __name__ == '__main__':
    main()
