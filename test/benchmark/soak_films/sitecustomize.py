# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Python imports this module at startup if this folder is in PYTHONPATH: scenes play films from the folder SOAK_FILMS (see rendered.py).

Everything else runs as a user starts it; films leave the machine's time to the sensors instead of rendering.
"""
import importlib.util
import os
import sys
from importlib.abc import MetaPathFinder
from pathlib import Path

_SCENES = 'tactile_driver.simulation.sensors.scenes'


class _Films(MetaPathFinder):
    """Replaces what opens a scene as soon as its module is there, before anybody has taken it from there."""

    def find_spec(self, name, path=None, target=None):
        """Of that one module; all others are left to the other finders."""
        if name != _SCENES:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        execute = spec.loader.exec_module

        def replaced(module):
            execute(module)
            sys.path.append(str(Path(__file__).resolve().parents[1]))
            from rendered import playing
            for opener in ('open_scene', 'open_dual_scene'):
                setattr(module, opener, playing(Path(os.environ['SOAK_FILMS']), getattr(module, opener)))
        spec.loader.exec_module = replaced
        return spec


sys.meta_path.insert(0, _Films())
