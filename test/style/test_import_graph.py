# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The import graph: no circle between modules, and no import from a lower room into a higher one."""

import ast
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: The rooms of each package, the lowest first. A module belongs to the room with the longest name that begins its own. A room imports
#: itself, lower rooms, and packages named before its own.
ROOMS = {
    'tactile_driver': ('errors', 'plugins', 'frame', 'nodes.messages.images', 'frame_names', 'lens', 'stamp_gaps',
        'recordings', 'stitching', 'simulation.truth', 'simulation.skin', 'simulation.optics', 'simulation.gel', 'simulation.scene',
        'simulation.sensors', 'simulation.psd', 'simulation.taxel', 'sources', 'camera', 'serial', 'sources.registry',
        'emulators', 'parameters', 'nodes.runtime', 'nodes.messages', 'nodes'),
    'tactile_perception': ('errors', 'sensor_type', 'common', 'dots', 'press.sensor', 'calibration.files', 'calibration', 'touchpad', 'gel',
        'finger', 'taxel',
        'parameters', 'press', 'api', 'evaluation', 'nodes', 'clock', 'stage', 'camera_stage', 'finger.stage', 'taxel.stage',
        'press.stage', 'touchpad.stage', 'dots.stage', 'work_log', 'node', 'bags', 'finger.tools', 'press.tools',
        'touchpad.tools', 'taxel.tools', 'gel.tools', 'tools.convert', 'tools.calibrate', 'tools'),
    'tactile_bringup': ('parameters', 'visualization',
         'guide', 'hand', 'launch', 'simulate', 'papers', 'nodes', 'demo'),
}


def path_of(package, path):
    names = path.relative_to(ROOT / package).with_suffix('').parts
    return '.'.join(names[:-1] if names[-1] == '__init__' else names)


FILES = {path_of(package, path): path for package in ROOMS for path in (ROOT / package / package).rglob('*.py')}


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


def height(module):
    """Return (package, room) as numbers; the root of a package, which imports nothing, is below all."""
    package, _, inside = module.partition('.')
    rooms = [room for room in ROOMS[package] if f'{inside}.'.startswith(f'{room}.')]
    return list(ROOMS).index(package), ROOMS[package].index(max(rooms, key=len)) if rooms else -1


def test_every_module_has_a_room():
    assert [module for module, path in FILES.items() if path.name != '__init__.py' and height(module)[1] < 0] == []


def test_no_import_goes_up():
    goes_up = [(module, other) for module in GRAPH for other in GRAPH[module] if height(other) > height(module)]
    assert goes_up == []


def test_no_circle():
    left = dict(GRAPH)
    while free := [module for module, others in left.items() if not others & set(left)]:
        for module in free:
            del left[module]
    assert left == {}
