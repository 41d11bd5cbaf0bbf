# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers at module level become no more: a constant is a field of its folder's frozen dataclass, or stands beside its only use."""
import ast
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIMITS = {'tactile_driver': 130, 'tactile_perception': 140, 'tactile_bringup': 90}  # counts, rounded up to ten: may only fall


def numbers(path):
    """Names that a file assigns at module level an expression with a number in it."""
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value and any(
                isinstance(part, ast.Constant) and type(part.value) in (int, float) for part in ast.walk(node.value)):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                yield from target.elts if isinstance(target, ast.Tuple) else [target]


@pytest.mark.parametrize('package', LIMITS)
def test_numbers_at_module_level_become_no_more(package):
    count = sum(len(list(numbers(path))) for path in (ROOT / package / package).rglob('*.py'))
    assert count <= LIMITS[package], 'give the new one to its folder\'s constants.py, or write it beside its only use'
