# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every estimator with every case of the table: bad numbers, degenerate positions, few entries, other precision, order and units."""
import functools

import numpy as np
import pytest

from cases import ESTIMATORS, WORDS, expectations
from hard_engine import CASES, SAME, off, outcome_of, wanted_of


@functools.cache
def plain(name):
    """Good inputs and what comes out of them."""
    good = ESTIMATORS[name].good()
    kind, found = outcome_of(ESTIMATORS[name], good)
    assert kind == 'told', f'{name} tells nothing of good input'
    return good, found


@pytest.mark.parametrize('name, case, letter', expectations(CASES), ids=lambda part: part if len(part) > 1 else WORDS[part])
@pytest.mark.filterwarnings('ignore::RuntimeWarning')
def test_what_must_come_out(record, name, case, letter):
    of, (good, found) = ESTIMATORS[name], plain(name)
    kind, told = outcome_of(of, CASES[case](of, good))
    error, most = float('nan'), float('nan')
    if told is not None and letter in ('SAK' if kind == 'nothing' else 'SAEK'):
        exact = letter != 'K'
        error = off(told, wanted_of(of, case, good, found) if exact else found, not exact)
        most = of.kept if not exact else of.single if case == 'single precision' else of.tolerance
    record.note(name, case, WORDS[letter], kind, error, 'of the largest' if letter in 'SAEK' else '')
    allowed = {'R': ('refused',), 'N': ('nothing',), 'E': ('told', 'nothing')}
    assert kind in allowed.get(letter, ('nothing' if case == 'none' else 'told',))
    assert not error > most
    assert letter != 'F' or (told['flags'] > 0).all()


def test_good_input_is_told_without_a_warning():
    with np.errstate(all='raise', under='ignore'):
        for of in ESTIMATORS.values():
            of.run(of.good())


def test_every_case_is_used():
    assert {case for _, case, _ in expectations(CASES)} == set(CASES) and SAME.keys() <= CASES.keys()
