# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pinned list holds every wanted package at one exact version for each Python."""

import pathlib

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
import pytest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / 'environment'


def requirements(name):
    lines = (FOLDER / name).read_text().splitlines()
    return [Requirement(line) for line in lines if line.strip() and not line.startswith('#')]


@pytest.mark.parametrize('python', ['3.10', '3.11', '3.12', '3.13'])
def test_every_wanted_package_is_pinned_once(python):
    here = {'python_version': python, 'python_full_version': python + '.1', 'sys_platform': 'linux'}
    valid = [one for one in requirements('requirements.txt') if not one.marker or one.marker.evaluate(here)]
    pinned = {canonicalize_name(one.name): str(one.specifier).removeprefix('==') for one in valid}
    assert len(pinned) == len(valid)
    for one in requirements('requirements.in'):
        assert one.specifier.contains(pinned[canonicalize_name(one.name)]), one
