# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated touchpad as fixtures."""
import pytest
import rig


@pytest.fixture(scope='session')
def pad():
    return rig.seen('touchpad')


@pytest.fixture(scope='session')
def small_pad():
    """The same view in a quarter of the pixels."""
    return rig.camera('touchpad', width=320, height=240)
