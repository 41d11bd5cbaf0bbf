# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tactile perception: algorithms on arrays and numbers, and thin ROS nodes over them.

`from tactile_perception import detect_dots` and the other names of __all__ need no ROS; docs/python.md shows how to use them. A name is
imported when it is first used, so that a node imports only what it needs.
"""
from importlib import import_module

import tactile_driver  # noqa: F401, for what it does about Ctrl-C

#: public name -> module of this package : name there
_PUBLIC = {
    'detect_dots': 'api:detect_dots',
    'index_dots': 'dots.number:number_grid',
    'DotOptions': 'dots.tracker:DotOptions',
    'DotTracker': 'dots.tracker:DotTracker',
    'Touchpad': 'touchpad.sensor:Touchpad',
    'touchpad_tracker': 'touchpad.positions:touchpad_tracker',
    'TouchpadContact': 'touchpad.estimator:ContactEstimator',
    'ContactDots': 'touchpad.region:ContactDots',
    'find_contact_regions': 'touchpad.region:find_regions',
    'SlipEstimator': 'touchpad.slip:SlipEstimator',
    'MarkerSensor': 'common.marker_sensor:MarkerSensor',
    'load_marker_touch': 'api:load_marker_touch',
    'PsdFinger': 'finger.parameters:PsdFinger',
    'FingerModel': 'finger.model:FingerModel',
    'TaxelArray': 'taxel.pressure:TaxelArray',
    'SoftPad': 'taxel.pressure:SoftPad',
    'TaxelEstimator': 'taxel.estimator:TaxelEstimator',
    'node_parameters': 'api:node_parameters',
    'TactileError': 'core.errors:TactileError',
    'BadArgument': 'core.errors:BadArgument',
    'BadCalibration': 'core.errors:BadCalibration',
    'BadFrame': 'core.errors:BadFrame',
}
__all__ = list(_PUBLIC)


def __getattr__(name: str):
    if name not in _PUBLIC:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    module, attribute = _PUBLIC[name].split(':')
    globals()[name] = found = getattr(import_module(f'.{module}', __name__), attribute)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
