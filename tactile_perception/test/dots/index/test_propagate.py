# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.dots.index.propagate import Links, walk


def links_of(rows, columns, skip=()):
    """Links of a whole grid, dots numbered row by row, without those in skip (pairs of dots)."""
    n = np.arange(rows * columns).reshape(rows, columns)
    row = np.stack([n[:, :-1].ravel(), n[:, 1:].ravel()])
    column = np.stack([n[:-1].ravel(), n[1:].ravel()])
    row, column = (pairs[:, [tuple(p) not in skip for p in pairs.T]] for pairs in (row, column))
    return Links(rows * columns, tuple(row), tuple(column))


def test_whole_grid():
    rc, known, contradictions = walk(links_of(3, 4))
    np.testing.assert_array_equal(rc - rc[0], np.stack(np.divmod(np.arange(12), 4), axis=1))
    assert known.all()
    assert contradictions == 0


def test_a_dot_with_one_link_joins():
    rc, known, _ = walk(links_of(3, 3, skip={(7, 8)}))
    assert known.all() and tuple(rc[8] - rc[0]) == (2, 2)


def test_a_dot_without_links_has_no_place():
    _, known, contradictions = walk(links_of(3, 3, skip={(7, 8), (5, 8)}))
    assert not known[8] and known[:8].all()
    assert contradictions == 0


def test_a_link_over_a_gap_contradicts():
    links = links_of(4, 5)
    for dot, other in ((1, 3), (6, 8)):  # two rows skip a dot: a mesh that closes all the same
        links.right[dot], links.left[other] = other, dot
    assert walk(links)[2] > 0


def test_no_links():
    nothing = (np.zeros(0, np.int64), np.zeros(0, np.int64))
    _, known, contradictions = walk(Links(3, nothing, nothing))
    assert known.sum() <= 1
    assert contradictions == 0
