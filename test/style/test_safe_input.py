# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What comes from files, messages and bags is data: no name in it is called, imported, or run."""

import ast
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
CODE = sorted(str(path.relative_to(ROOT)) for package in ('tactile_driver', 'tactile_perception', 'tactile_bringup')
              for folder in (package, 'launch') for path in (ROOT / package / folder).rglob('*.py'))
CALLS = {'eval', 'exec', 'compile', '__import__'}
MODULES = {'pickle', 'marshal', 'shelve', 'subprocess', 'pty', 'code', 'runpy', 'dill', 'joblib'}
SYSTEM = {'system', 'popen', 'startfile', 'spawnl', 'spawnv', 'execv', 'execl', 'execvp', 'posix_spawn'}
UNSAFE_YAML = {'unsafe_load', 'unsafe_load_all', 'full_load', 'full_load_all', 'load_all', 'UnsafeLoader', 'FullLoader', 'Loader',
               'CLoader', 'UnsafeConstructor', 'FullConstructor'}
#: Where one of these is right, and why.
ALLOWED: dict[str, set[str]] = {}
#: Where modules are imported by name, each from a table or an entry point in the code itself.
IMPORTERS = {'tactile_perception/tactile_perception/sensors.py', 'tactile_perception/tactile_perception/__init__.py',
             'tactile_driver/tactile_driver/sources/registry.py'}


def found_in(name):
    """What a file has of all these."""
    for node in ast.walk(ast.parse((ROOT / name).read_text(), filename=name)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CALLS:
            yield node.func.id
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split('.')[0] in MODULES)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module.split('.')[0] in MODULES:
            yield node.module
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id == 'os' and node.attr in SYSTEM) or (node.value.id == 'yaml' and node.attr in UNSAFE_YAML):
                yield f'{node.value.id}.{node.attr}'
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == 'yaml.load' and len(node.args) + len(node.keywords) < 2:
            yield 'yaml.load without a loader'
        elif isinstance(node, ast.keyword) and node.arg == 'allow_pickle' and getattr(node.value, 'value', True):
            yield 'allow_pickle'


def test_nothing_that_is_read_can_be_run():
    found = {name: set(found_in(name)) - ALLOWED.get(name, set()) for name in CODE}
    assert {name: what for name, what in found.items() if what} == {}


def test_modules_are_imported_by_name_in_few_places():
    assert {name for name in CODE if re.search('import_module|resolve_name', (ROOT / name).read_text())} == IMPORTERS
