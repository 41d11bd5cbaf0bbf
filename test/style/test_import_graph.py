# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The import graph: no circle between modules, and no import upwards or from one sensor's folder into another's."""
import ast
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGES = 'tactile_driver', 'tactile_perception', 'tactile_bringup'  # each imports itself and those before it
#: Folders of tactile_perception above what all share, from the lowest: a module imports from its own folder and from lower rows. Folders of
#: a row do not import each other: a sensor's folder knows no other sensor.
ROWS = ({'dots'}, {'bags'}, {'touchpad', 'press', 'gel', 'finger', 'taxel'}, {'published'}, {'evaluation'}, {'tools', 'api'})


def path_of(package, path):
    names = path.relative_to(ROOT / package).with_suffix('').parts
    return '.'.join(names[:-1] if names[-1] == '__init__' else names)


FILES = {path_of(package, path): path for package in PACKAGES for path in (ROOT / package / package).rglob('*.py')}


def imported(module):
    """Return the modules of this project that a module imports, wherever in its code."""
    path, found = FILES[module], set()
    for node in ast.walk(ast.parse(path.read_text(), filename=str(path))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parent = module.split('.')[:len(module.split('.')) - node.level + (path.name == '__init__.py')] if node.level else []
            base = '.'.join(parent + ([node.module] if node.module else []))
            found.update(f'{base}.{alias.name}' if f'{base}.{alias.name}' in FILES else base for alias in node.names)
    return found & set(FILES) - {module}


GRAPH = {module: imported(module) for module in FILES}


def row(folder):
    """The number of a folder's row; -1 for what all share."""
    return next((number for number, row in enumerate(ROWS) if folder in row), -1)


def test_a_module_imports_its_own_folder_and_lower_ones():
    wrong = []
    for module, other in ((module, other) for module in GRAPH for other in GRAPH[module]):
        (package, *inside), (other_package, *other_inside) = module.split('.'), other.split('.')
        mine, its = (inside or [''])[0], (other_inside or [''])[0]
        if PACKAGES.index(other_package) > PACKAGES.index(package) or package == other_package == 'tactile_perception' and mine != its and (
                row(its) >= max(row(mine), 0)):
            wrong.append((module, other))
    assert wrong == []


def test_a_simulation_knows_no_driver():
    assert not [(module, other) for module in GRAPH for other in GRAPH[module] if module.startswith('tactile_driver.simulation.')
                and other.startswith(('tactile_driver.nodes.', 'tactile_driver.camera', 'tactile_driver.serial'))]


def test_no_circle():
    left = dict(GRAPH)
    while free := [module for module, others in left.items() if not others & set(left)]:
        for module in free:
            del left[module]
    assert left == {}
