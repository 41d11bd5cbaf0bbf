# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
sys.path.insert(0, str(Path(__file__).parent))
from grip_reaction import reactions, table  # noqa: E402

# Two slips, of which the first becomes gross; a first touch at 1.0, closing at 2.3 and 2.4, nothing in the second slip.
TRUTH = [(1.9, 0), (2.0, 1), (2.1, 1), (2.2, 2), (2.3, 2), (2.6, 0), (2.7, 1), (3.5, 0), (4.0, 1), (4.1, 0)]
COMMANDS = [(0.9, 0.91, 0.0), (1.0, 1.01, 1.0), (2.2, 2.21, 1.0), (2.3, 2.32, 1.2), (2.4, 2.42, 1.4), (4.0, 4.01, 1.4), (4.2, 4.21, 0.0)]


def test_from_onset_to_the_first_command_that_closes():
    first, second = reactions(TRUTH, COMMANDS)
    assert (first.stamps, first.from_gross, first.received) == pytest.approx((0.3, 0.1, 0.32))
    assert np.isnan([second.stamps, second.from_gross, second.received]).all()


def test_nothing_heard():
    assert reactions([], []) == [] and reactions([(1.0, 0)], [(1.0, 1.0, 0.0)]) == []


def test_the_table_says_what_was_not_answered():
    lines = table(reactions(TRUTH, COMMANDS)).splitlines()
    assert [cell.strip() for cell in lines[1].split('|')] == ['slip 1', '300', '100', '320']
    assert [cell.strip() for cell in lines[2].split('|')] == ['slip 2', '-', '-', '-'] and '300' in lines[3]
