# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The state of a sensor's stages as bytes, and back: what they know of earlier frames, to the last bit."""
from __future__ import annotations

import io
import pickle
from types import FunctionType

from ..errors import BadRecording

# A pickle can name any function to be called. Those that are let through make numbers, messages and this software's own objects: own
# classes, and own functions that compute; never what a module of ours has only imported, as it might os.
_OWN = ('tactile_perception.', 'tactile_driver.stitch', 'tactile_driver.frame', 'tactile_driver.lens', 'tactile_msgs.', 'sensor_msgs.',
        'std_msgs.', 'geometry_msgs.', 'builtin_interfaces.')
_WITH_FILES = ('tactile_perception.offline.', 'tactile_perception.calibration.', 'tactile_perception.nodes.')  # of these no functions
_NAMES = {
    'builtins': {'set', 'frozenset', 'slice', 'range', 'complex', 'bytearray'},
    'collections': {'deque', 'OrderedDict', 'Counter', 'defaultdict'},
    'functools': {'partial'},
    'array': {'array', '_array_reconstructor'},
}
_LIBRARIES = {
    'numpy': {'_reconstruct', 'ndarray', 'dtype', 'scalar', '_frombuffer'},
    'scipy': {'csr_matrix', 'csc_matrix', 'csr_array', 'csc_array'},
}


def _method(owner: object, name: str):
    """A public method of an own object, which a pickle makes by getattr. Raises BadRecording for anything else."""
    if name.startswith('_') or not type(owner).__module__.startswith(_OWN):
        raise BadRecording(f'stored state: {name} of {type(owner).__name__} is no part of it; do not go on from it')
    return getattr(owner, name)


def _is_own(found: object, module: str) -> bool:
    """Whether it is a class that an own module defines, or a function that has nothing to do with files."""
    if not module.startswith(_OWN) or getattr(found, '__module__', None) != module:
        return False
    return isinstance(found, type) or isinstance(found, FunctionType) and not module.startswith(_WITH_FILES)


class _Unpickler(pickle.Unpickler):
    """Makes nothing but what a stage's state is made of."""

    def find_class(self, module: str, name: str):
        """The class or function of that name. Raises BadRecording for any other than those."""
        if (module, name) == ('builtins', 'getattr'):
            return _method
        if name in _NAMES.get(module, ()) or name in _LIBRARIES.get(module.partition('.')[0], ()):
            return super().find_class(module, name)
        found = super().find_class(module, name) if module.startswith(_OWN) else None
        if not _is_own(found, module):
            raise BadRecording(f'stored state: {module}.{name} is no part of it; do not go on from it')
        return found


def store_state(stage: object) -> bytes:
    """The stage with all that it knows."""
    return pickle.dumps(stage, protocol=pickle.HIGHEST_PROTOCOL)


def load_state(data: bytes):
    """What store_state stored. Raises BadRecording where data is none of it."""
    try:
        return _Unpickler(io.BytesIO(data)).load()
    except BadRecording:
        raise
    except Exception as error:  # whatever broken bytes provoke
        raise BadRecording(f'stored state cannot be read: {error}') from error
