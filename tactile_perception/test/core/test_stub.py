# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled module's stub: every public name of it with its methods and attributes, all of them with types."""
import ast
from pathlib import Path
from types import ModuleType

import pytest
from tactile_perception import _core

STUBS = Path(_core.__file__).resolve().parent / 'stubs' / '_core'
MODULES = {'__init__': _core, **{name: value for name, value in vars(_core).items() if isinstance(value, ModuleType)}}


def public(names) -> set:
    return {name for name in names if not name.startswith('_')}


def declared(body: list) -> dict:
    """Name to node of what a stub declares."""
    return {getattr(node, 'name', None) or node.target.id: node for node in body
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AnnAssign)}


@pytest.fixture(params=MODULES)
def name(request):
    """Of a module that has a stub."""
    if not STUBS.is_dir():
        pytest.skip('pybind11-stubgen was not installed when the module was built')
    return request.param


def parsed(name: str) -> ast.Module:
    return ast.parse((STUBS / f'{name}.pyi').read_text())


def test_the_stub_declares_what_the_module_holds(name):
    module, stub = MODULES[name], declared(parsed(name).body)
    assert public(vars(module)) - set(MODULES) == public(stub) - {'annotations'}
    for key in public(stub):
        value = getattr(module, key)
        if isinstance(value, type):
            assert public(vars(value)) == public(declared(stub[key].body)), key


def test_every_argument_and_result_has_a_type(name):
    for node in ast.walk(parsed(name)):
        if isinstance(node, ast.FunctionDef) and not node.name.startswith('__'):
            untyped = [argument.arg for argument in node.args.args if argument.arg != 'self' and argument.annotation is None]
            assert not untyped and node.returns is not None, f'{node.name}: {untyped}'
