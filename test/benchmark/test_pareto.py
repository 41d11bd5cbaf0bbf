# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math
import sys
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import pareto  # noqa: E402
from parts import PARTS  # noqa: E402
from results import Entry  # noqa: E402


def test_the_front_is_what_no_other_beats():
    assert pareto.front([(3, 1), (1, 5), (2, 6), (2, 2), (4, 1.5)]) == [(1, 5), (2, 2), (3, 1)]
    assert pareto.front([]) == []


def test_every_part_has_a_panel():
    assert set(pareto.SHOWN) == set(PARTS) and all(error in PARTS[part].errors for part, (_, error) in pareto.SHOWN.items())


def test_the_picture(tmp_path):
    entries = [Entry(part, part, method, size, [ms], [ms], {error: [off]}) for part, (_, error) in pareto.SHOWN.items()
               for method, size, ms, off in (('a', '640 x 480', 1.0, 0.1), ('b', '320 x 240', 3.0, 0.01), ('c', '', 9.0, math.nan))]
    pareto.draw(entries, tmp_path / 'p.png')
    assert np.ptp(cv2.imread(str(tmp_path / 'p.png'))) == 255 and (tmp_path / 'p.png').stat().st_size < 300_000
    pareto.draw(entries[:3], tmp_path / 'one.png')
    assert (tmp_path / 'one.png').exists()
