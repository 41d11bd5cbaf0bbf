# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The udev rules are rules, with names for cameras and serial sensors."""
import re
import shutil
import subprocess
from pathlib import Path

import pytest

RULES = Path(__file__).parents[1] / 'udev' / '70-tactile-sensors.rules'
TOKEN = re.compile(r'([A-Z]+)(?:\{(\w+)\})?(==|!=|\+=|=)"([^"]*)"')


def rules():
    """(key, operator, value) of each line with a rule."""
    lines = [line for line in RULES.read_text().splitlines() if line and not line.startswith('#')]
    assert all(re.fullmatch(rf'{TOKEN.pattern}(, {TOKEN.pattern})*', line) for line in lines)
    return [[(key, operator, value) for key, _, operator, value in TOKEN.findall(line)] for line in lines]


def test_cameras_and_serial_sensors_have_names_and_permissions_before_73_seat_late_grants_them():
    tokens = sum(rules(), [])
    assert {value.split('_')[0] for key, _, value in tokens if key == 'SYMLINK'} == {'tactile/serial', 'tactile/camera'}
    assert {value for key, _, value in tokens if key == 'GROUP'} == {'dialout', 'video'}
    assert ('TAG', '+=', 'uaccess') in tokens and 60 < int(RULES.name[:2]) < 73


def test_udevadm_finds_nothing():
    udevadm = shutil.which('udevadm')
    if not udevadm or subprocess.run([udevadm, 'verify', '--help'], capture_output=True).returncode:
        pytest.skip('udevadm verify (systemd 254 or newer) is not installed')
    found = subprocess.run([udevadm, 'verify', '--no-style', str(RULES)], capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
