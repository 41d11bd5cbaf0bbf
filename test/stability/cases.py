# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The table of estimators and input cases, with the expected outcome of each.

R  refused by a named error
N  no result: NaN, no contact
S  the same result (in another order, in other units, of the remaining entries)
A  scaled with the input
K  kept: unaffected by a few bad entries, to some percent
E  scaled with the input, or no result where the numbers exceed their range
T  a finite result: the input is another good one (references have tests of their own), or a published method, kept for comparison,
   accepts it as it is
F  a result with a flag
-  no such case
"""
from __future__ import annotations

from hard_dots import DOTS
from hard_geometry import GEOMETRY
from hard_psd import PSD
from hard_sheets import SHEETS
from hard_taxels import TAXELS

ESTIMATORS = GEOMETRY | PSD | TAXELS | DOTS | SHEETS

# one NaN, all NaN, one infinite, all infinite, zero, denormal, tiny, huge, largest | none, one, two, at one place, on a line |
# single precision, other order, units x 1000
_TABLE = """
rigid fit               R R R R R R R T R   R R R R R   S S S
rigid fit, robust       R R R R R R R R R   R R R R R   S S S
object motion           R R R R N N N N R   N N N N N   S S S
planar twist            N N N N T A A A E   N N K T T   S S S
planar twist, places    N N N N N N N T N   N N K N T   S S -
friction centre         N N N N N A A A E   N N N N N   S S S
region                  R R R R N N A A N   N N N N N   S S S
region, score           R R R R N N N T T   N N N N N   S S S
contact                 R R R R N N T T N   N N N N N   S S -
camera, rays            K N K N T T T N N   N S S S T   S S -
camera, view            K N K N T T T N N   N S S S T   S S -
homography              K N K N T T T N N   N S S S T   S S -
cap                     K N K N N N N T N   N S S S T   S S -
sheet surface           K N K N A A A A A   - - - T T   S - S
Gaussian point          K N K N N A A A A   - - - T T   S - S
PSD map                 K N K N N N N N N   - - - N K   S - -
PSD paper               K N K N N N N N N   - - - N K   S - -
PSD place               K N K N N A A A A   N S S S T   S S -
PSD paper map fit       R R R R R R R A R   R T A R A   S S -
sphere, angles          K N K N T K K K K   N S S S T   S S -
sphere filter           R R R R R R R R R   - - - T R   S - -
touch filter            R R R R A A A T T   - - - T K   S - -
taxels, mechanics       K R K R N N N R R   - - - N N   S - -
taxels, paper           K R K R N N N R R   - - - N N   S - -
taxel response fit      K R K R R R R T T   R R R R T   S S -
numbers, lattice        K N K N N N N N N   N N N N N   S S -
numbers, paper          N N N N T T T N N   N N N T N   S S -
numbers, register       K N K N N N K N N   N N N N N   S S -
numbers, tracks         K N K N N N N N N   N T T K T   S S -
reference               K N K N T T T T T   N T T T T   S S -
sheet, model            K N K N R R R R R   N N N R N   S S -
sheet, model, areas     K K K K K N N N N   N N N K K   S S -
sheet, paper            K T K T T T T F F   - - - T T   S - -
sheet, paper, growth    K T K T T T T T T   - - - T T   S - -
cushion, model          K N K N N N N N N   N N N N N   S S -
cushion, paper          K N K N N N N F F   - - - N N   S - -
stitching fit           R R R R R R R R R   - - - R R   S - -
pad, places             K N K N N N N R R   N T T N T   S S -
pad, membrane           K R K R R R R R R   N N N R R   S S -
pad, paper              K R K R N N N R R   N N N N N   S S -
"""
WORDS = {'R': 'refused', 'N': 'nothing', 'S': 'the same', 'A': 'grown along', 'E': 'grown along or nothing', 'K': 'kept', 'T': 'told',
         'F': 'flagged'}


def expectations(cases) -> list[tuple[str, str, str]]:
    """(estimator, case, letter) of every cell."""
    rows = [(line[:24].strip(), line[24:].split()) for line in _TABLE.strip().splitlines()]
    assert [name for name, _ in rows] == list(ESTIMATORS), 'a row for every estimator'
    return [(name, case, letter) for name, letters in rows for case, letter in zip(cases, letters, strict=True) if letter != '-']
