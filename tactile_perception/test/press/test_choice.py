# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Hypotheses of a marker field compared by their evidence."""
from types import SimpleNamespace

import pytest
from tactile_perception.press.choice import DRAGGED, STRAIGHT, TWO, Choice, Evidence

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


class Fits:
    """Fits of one press or two, with the residuals that each hypothesis leaves."""

    def __init__(self, straight, dragged, two):
        self.left, self.tried = {STRAIGHT: straight, DRAGGED: dragged, TWO: two}, []

    def of(self, what, presses):
        self.tried.append(what)
        return SimpleNamespace(misfit=self.left[what], presses=presses, what=what)

    def explained_by(self, choice):
        return choice.explain(EVIDENCE, lambda start, what: self.of(what, start), ['begin'], lambda: self.of(TWO, ['one', 'other'])).what


def test_a_drag_lasts_until_the_touch_ends():
    choice, lifted = Choice(), Fits(0.5, 0.5, 9.0)
    assert lifted.explained_by(choice) is STRAIGHT and lifted.tried == [STRAIGHT], 'what cannot win is not fitted'
    assert Fits(9.0, 0.5, 9.0).explained_by(choice) is DRAGGED and choice.dragged == ['begin']
    assert lifted.explained_by(choice) is DRAGGED and lifted.explained_by(Choice()) is STRAIGHT


def test_two_presses_win_where_neither_kind_of_one_explains_the_frame():
    assert Fits(9.0, 8.0, 0.5).explained_by(Choice()) is TWO and Fits(9.0, 0.6, 0.5).explained_by(Choice()) is DRAGGED
