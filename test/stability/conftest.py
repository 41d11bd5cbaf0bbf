# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated touchpad as fixtures, and the record of hard cases, written at the end of a run."""
import pathlib

import pytest

from hard_engine import Record
from pad_rig import Pad, shared_pad

HERE = pathlib.Path(__file__).resolve().parent


@pytest.fixture(scope='session')
def pad():
    return shared_pad()


@pytest.fixture(scope='session')
def small_pad():
    """The same view in a quarter of the pixels."""
    return Pad(width=320, height=240)


@pytest.fixture(scope='session')
def record():
    """What the cases of this run have measured; out/stability.json and out/stability.md when all have run."""
    kept = Record()
    yield kept
    kept.write(HERE.parents[1] / 'out')
