# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pinned list holds every wanted package at one exact version for each Python."""

import importlib.util
import pathlib
import re

import pytest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / 'environment'
PYTHONS = ('3.10', '3.11', '3.12', '3.13')


def load(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f'{name}.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def pins(python):
    """Return {name: version} of the lines that hold for this Python."""
    found = {}
    for line in (FOLDER / 'requirements.txt').read_text().splitlines():
        if line.startswith('#') or (';' in line and f'"{python}"' not in line):
            continue
        name, version = line.partition(' ;')[0].split('==')
        assert name not in found
        found[name] = version
    return found


@pytest.mark.parametrize('python', PYTHONS)
def test_every_wanted_package_is_pinned(python):
    lines = [line for line in (FOLDER / 'requirements.in').read_text().splitlines() if line.strip() and not line.startswith('#')]
    wanted = {re.split(r'[<=>]', line.strip())[0] for line in lines}
    assert wanted <= set(pins(python))


def test_merge_marks_only_what_differs():
    merged = load('lock').merge({'3.10': {'a': '1', 'b': '1', 'c': '2'}, '3.11': {'a': '1', 'b': '2'}})
    assert merged == ['a==1', 'b==1 ; python_version == "3.10"', 'b==2 ; python_version == "3.11"', 'c==2 ; python_version == "3.10"']
