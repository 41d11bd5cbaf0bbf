# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The import graph: no cycle, and no import upwards or from one sensor's folder into another's."""
import ast
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGES = 'tactile_driver', 'tactile_perception', 'tactile_bringup'  # each imports itself and those before it
#: Folders of tactile_perception, from the lowest: a module imports from its own folder and from lower rows. Folders of a row do not import
#: each other: a sensor's folder knows no other sensor.
ROWS = ({'core'}, {'common'}, {'dots'}, {'bags'}, {'layer'},
        {path.parent.name for path in (ROOT / 'tactile_perception' / 'tactile_perception').glob('*/sensor_type*.py')} - {'core', 'dots'},
        {'published'}, {'evaluation'}, {'tools', 'api'})


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


def row(module):
    """Folder of a module of tactile_perception and the folder's row; the package itself is below all rows."""
    folder = (module.split('.')[1:] or [''])[0]
    return folder, next((number for number, row in enumerate(ROWS) if folder in row), -1)


def test_a_module_imports_its_own_folder_and_lower_ones():
    edges = [(module, other, module.split('.')[0], other.split('.')[0]) for module in GRAPH for other in GRAPH[module]]
    assert [edge for edge in edges if PACKAGES.index(edge[3]) > PACKAGES.index(edge[2])] == []
    inside = [(row(module), row(other), module, other) for module, other, *packages in edges if {*packages} == {'tactile_perception'}]
    assert [edge for edge in inside if edge[0][0] != edge[1][0] and edge[1][1] >= max(edge[0][1], 0)] == []


def test_simulation_imports_no_driver():
    assert not [(module, other) for module in GRAPH for other in GRAPH[module] if module.startswith('tactile_driver.simulation.')
                and other.startswith(('tactile_driver.nodes.', 'tactile_driver.camera', 'tactile_driver.serial'))]


def test_there_is_no_import_cycle():
    left = dict(GRAPH)
    while free := [module for module, others in left.items() if not others & set(left)]:
        for module in free:
            del left[module]
    assert left == {}
