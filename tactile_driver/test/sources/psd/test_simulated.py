# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.serial.psd import PsdSimulatedSource


def test_wrong_settings():
    with pytest.raises(BadArgument, match='real time'):
        PsdSimulatedSource('demo', 0, 0, 0.01, time.time_ns)
    with pytest.raises(BadArgument, match='taps'):
        PsdSimulatedSource('nowhere', -1, 0, 0.01, time.time_ns).open()
