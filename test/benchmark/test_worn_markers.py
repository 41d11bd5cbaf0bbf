# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import worn_markers  # noqa: E402
from worn_markers import Print, photograph, score, together  # noqa: E402

from tactile_driver.simulation.sensors.scenes import open_scene  # noqa: E402
from tactile_perception.dots.tracker import DotTracker  # noqa: E402


def test_markers_of_all_sizes_arrangements_and_wear_are_found():
    """On sheets by which nothing was chosen."""
    scores = [one for _, one in worn_markers.run(9, 4, ('discs',))['discs']]
    row = together(scores).row()
    assert row['recall'] > 0.95 and row['false'] < 0.02
    assert min(one.row()['recall'] for one in scores) > 0.8
    assert row['rms px'] < 1.2 and 0.5 < row['error over sigma'] < 2


@pytest.mark.parametrize('bright', [True, False])
def test_heavily_worn_markers_of_24_px(bright):
    scores = [score(photograph(Print(layout=layout, bright=bright), 40 + k), 'discs') for k, layout in enumerate(('grid', 'hexagonal'))]
    row = together(scores).row()
    assert row['recall'] > 0.9 and row['false'] < 0.02
    assert row['rms px'] < 1.5 and 0.5 < row['error over sigma'] < 2


def test_markers_as_printed_are_placed_to_a_tenth_of_a_pixel():
    row = score(photograph(Print(wear=0.0, layout='random'), 50), 'discs').row()
    assert row['recall'] == 1 and row['false'] == 0
    assert row['rms px'] < 0.1 and 0.5 < row['error over sigma'] < 2


@pytest.mark.parametrize('wear', [0.0, 1.0])
def test_auto_is_as_good_as_the_best(wear):
    sheet = photograph(Print(wear=wear), 60)
    best = min((score(sheet, method).row() for method in ('discs', 'blobs', 'likelihood')),
               key=lambda row: (row['recall'] < 0.9, row['rms px']))
    row = score(sheet, 'auto').row()
    assert row['recall'] >= best['recall'] - 0.03 and row['rms px'] < 1.5 * best['rms px'] + 0.02


@pytest.mark.parametrize('scene, rows, columns, polarity', [('worn_grid', 11, 15, 'bright'), ('worn_hexagonal', 0, 0, 'bright'),
                                                            ('worn_random_dark', 0, 0, 'dark')])
def test_numbers_stay_while_a_fingertip_presses(scene, rows, columns, polarity):
    """Each number is one marker's from rest into the press; on a grid it is the right one."""
    film = open_scene(scene, rate=15.0, seed=2)
    assert (film.rows, film.columns) == (rows, columns)
    tracker, owner, seen, true = DotTracker(rows, columns, polarity, 'discs'), {}, 0, 0
    for k in range(22, 46):
        frame = film.render(k / film.rate)
        tracks = tracker.process(frame.image, k / film.rate)
        away = np.hypot(*(tracks.uv[:, None] - frame.truth.dot_uv).transpose(2, 0, 1))
        near = away.min(axis=1) < 8
        for number, marker in zip(tracks.id[near].tolist(), away.argmin(axis=1)[near].tolist()):
            assert owner.setdefault(number, marker) == marker
        seen, true = seen + near.sum(), true + len(frame.truth.dot_uv)
    if rows:
        assert all(number == marker for number, marker in owner.items())
    assert seen > 0.85 * true


def test_a_table_says_what_was_scored():
    sheet = photograph(Print(diameter=20, count=60, wear=0.3), 3)
    one = score(sheet, 'discs')
    assert one.found + one.false >= one.found > 50 and len(one.errors) == len(one.sigma)
    assert worn_markers.line('discs', together([one, one])).startswith(f'| discs | {100 * one.found / one.true:.1f} |')
