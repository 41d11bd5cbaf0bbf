# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Hypotheses of a marker field compared by their evidence."""
import pytest
from tactile_perception.press.choice import DRAGGED, STRAIGHT, TWO, Evidence

EVIDENCE = Evidence(351, 0.5)


@pytest.mark.parametrize('more', [DRAGGED, TWO])
def test_a_hypothesis_with_more_numbers_wins_only_where_it_leaves_much_less(more):
    assert EVIDENCE.of(STRAIGHT, 2.0) > EVIDENCE.of(more, 1.9)
    assert EVIDENCE.of(STRAIGHT, 2.0) < EVIDENCE.of(more, 0.5)
    assert EVIDENCE.of(STRAIGHT, 0.5) > EVIDENCE.of(more, 0.01), 'below an ordinary residual no fit is better'


def test_few_markers_tell_less():
    assert Evidence(60, 0.5).of(STRAIGHT, 2.0) > Evidence(60, 0.5).of(TWO, 0.5)


def test_what_cannot_win_need_not_be_fitted():
    assert not EVIDENCE.may_win(TWO, EVIDENCE.of(STRAIGHT, 0.6)) and EVIDENCE.may_win(TWO, EVIDENCE.of(STRAIGHT, 5.0))
