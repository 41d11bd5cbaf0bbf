# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts of a gel beside known ones, as a table and a figure: of simulated presses, or of labelled photographs.

    python3 test/benchmark/gel_presses.py [--figure FIGURE.png]
    python3 test/benchmark/gel_presses.py --photographs FOLDER --pitch 2.06 [--thickness 4] [--figure FIGURE.png]

FOLDER is a calibration folder as gs_sdk makes it: background.png, and folders DIAMETERmm/NUMBER with gelsight.png and label.npz, which has
center and radius, px, of the circle in which a ball touches.
"""
import argparse
import sys
from pathlib import Path

import cv2
import numpy as np

from tactile_driver.parameters.table import defaults
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.errors import BadFrame
from tactile_perception.gel.estimator import GelEstimator
from tactile_perception.gel.parameters import GEL_PARAMETERS

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'tactile_perception' / 'test' / 'helpers'))
from pressed_gel import CENTRE, METRES, pressed_gel  # noqa: E402  after the path

UNTOUCHED, HELD, PERIOD_S = 10, 3, 0.04  # images before and during each press; s from one to the next
DRAWN = 8  # presses in the figure


def estimates(estimator, untouched, pressed):
    """Contacts in untouched frames, the result of a held press, and contacts after it. Raises BadFrame."""
    frames = [untouched] * UNTOUCHED + [pressed] * HELD + [untouched]
    results = [estimator.process(frame, PERIOD_S * number) for number, frame in enumerate(frames)]
    return sum(len(result.contacts) for result in results[:UNTOUCHED]), results[-2], len(results[-1].contacts)


def row_of(found, pixels, centre, radius, pitch, ball_px, metres):
    """One line of the table: number of contacts, error of the middle, pitches, area and depth over the known ones, slip, false contacts."""
    false, result, after = found
    row = [len(result.contacts), np.nan, np.nan, np.nan, result.slip.state, false + after]
    if result.contacts:
        area = cv2.contourArea(np.float32(pixels[0]))
        depth = (ball_px - np.sqrt(max(ball_px**2 - radius**2, 0.0))) * metres
        row[1:4] = [np.hypot(*(np.mean(pixels[0], axis=0) - centre)) / pitch, area / (np.pi * radius**2), result.contacts[0].depth / depth]
    return row


def outlines_of(estimator, result):
    """Outlines of the contacts, px."""
    return [estimator.to_image(line[:, :2]) for line in result.region.outlines]


def photographs(folder, pitch, thickness):
    """(line of the table, tracks, outlines, known centre and radius) of each labelled photograph."""
    values = {**defaults(GEL_PARAMETERS), 'rows': 0, 'columns': 0, 'gel.pitch': pitch,
              'gel.thickness': thickness, 'gel.friction': 0.5}
    background = cv2.imread(str(folder / 'background.png'))
    size = np.array(background.shape[1::-1])
    for label in sorted(folder.glob('*mm/*/label.npz')):
        known = np.load(label)
        centre, radius, ball = known['center'].astype(float), float(known['radius']), 0.5e-3 * float(label.parent.parent.name[:-2])
        tracker = make_tracker(values, image_only=True)
        estimator = GelEstimator(values, (size - 1) / 2)
        try:
            for number in range(UNTOUCHED):
                untouched = tracker.process(background, PERIOD_S * number)
            tracks = tracker.process(cv2.imread(str(label.parent / 'gelsight.png')), PERIOD_S * UNTOUCHED)
            found = estimates(estimator, untouched, tracks)
        except BadFrame as error:
            print(f'{label.parent}: refused: {error}')
            continue
        metres, outlines = estimator.metres, outlines_of(estimator, found[1])
        yield row_of(found, outlines, centre, radius, pitch / metres, ball / metres, metres), tracks, outlines, centre, radius


def simulated(count):
    """The same of simulated balls of 2.5 mm radius on gels of unknown thickness, by a camera that is not calibrated."""
    for seed in range(count):
        rng = np.random.default_rng([seed, 53])
        gel = pressed_gel(rng, pitch=2e-3, thickness=rng.uniform(3e-3, 6e-3), radius=2.5e-3, depth=rng.uniform(0.3e-3, 0.8e-3),
                          middle=rng.uniform(-4e-3, 4e-3, 2), way=rng.uniform(-0.2e-3, 0.2e-3, 2))
        estimator = GelEstimator(gel.parameters | {'gel.thickness': 0.0, 'gel.dot_depth': 0.0}, CENTRE)
        state, tracks = gel.states[-1], gel.tracks(gel.states[-1], rng)
        found = estimates(estimator, gel.tracks(None, rng), tracks)
        centre, outlines = state.middle / METRES + CENTRE, outlines_of(estimator, found[1])
        radius = np.sqrt(len(state.places) * gel.contact.cell**2 / np.pi) / METRES
        yield row_of(found, outlines, centre, radius, 2e-3 / METRES, 2.5e-3 / METRES, METRES), tracks, outlines, centre, radius


def draw(presses, path):
    """Dots, displacements (five times), known circle and our contact of each press."""
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(2, 4, figsize=(12, 5))
    for axis, (_, tracks, outlines, centre, radius) in zip(axes.flat, presses):
        axis.quiver(*tracks.rest_uv.T, *tracks.duv.T, angles='xy', scale_units='xy', scale=0.2, width=0.004)
        axis.plot(*tracks.uv.T, 'k.', markersize=3)
        axis.add_patch(plt.Circle(tuple(centre), radius, fill=False, color='tab:blue', linestyle='--'))
        for outline in outlines:
            axis.plot(*np.vstack([outline, outline[:1]]).T, color='tab:red')
        axis.set(aspect='equal', xticks=[], yticks=[])
        axis.invert_yaxis()
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--photographs', type=Path, metavar='FOLDER')
    parser.add_argument('--pitch', type=float, default=2.0, help='distance of neighbouring dots, mm')
    parser.add_argument('--thickness', type=float, default=0.0, help='of the gel, mm; 0: not known')
    parser.add_argument('--presses', type=int, default=24, help='simulated ones')
    parser.add_argument('--figure', type=Path)
    given = parser.parse_args()
    presses = list(photographs(given.photographs, 1e-3 * given.pitch, 1e-3 * given.thickness) if given.photographs
                   else simulated(given.presses))
    if not presses:
        sys.exit('no press; give a folder with background.png and DIAMETERmm/NUMBER/label.npz')
    table = np.array([press[0] for press in presses])
    print(f'{len(table)} presses; with one contact {np.mean(table[:, 0] == 1):.0%}; slip called {np.mean(table[:, 4] > 0):.0%}; with a '
          f'contact before or after {np.mean(table[:, 5] > 0):.0%}')
    for name, column in (('error of the middle, pitches', 1), ('area over the known one', 2), ('depth over that of the ball in it', 3)):
        known = table[np.isfinite(table[:, column]), column]
        shares = np.percentile(known, [5, 50, 95]) if len(known) else [np.nan] * 3
        print(f'{name}: 5 %, median, 95 %: {shares[0]:.2f} {shares[1]:.2f} {shares[2]:.2f}')
    print(f'area within a factor 1.5: {np.mean((table[:, 2] < 1.5) & (table[:, 2] > 1 / 1.5)):.0%}')
    if given.figure:
        draw(presses[:DRAWN], given.figure)


if __name__ == '__main__':
    main()
