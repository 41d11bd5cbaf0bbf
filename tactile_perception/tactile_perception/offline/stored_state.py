# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The state of a sensor's stages as bytes, and back: what they know of earlier frames, to the last bit."""
from __future__ import annotations

import io
import pickle

from ..errors import BadRecording

# A pickle can name any function to be called; those of these modules make numbers, messages and this software's own objects.
_MODULES = ('tactile_perception.', 'tactile_driver.', 'tactile_msgs.', 'sensor_msgs.', 'std_msgs.', 'geometry_msgs.', 'builtin_interfaces.')
_NAMES = {
    'builtins': {'set', 'frozenset', 'slice', 'range', 'complex', 'bytearray', 'getattr'},
    'collections': {'deque', 'OrderedDict', 'Counter', 'defaultdict'},
    'functools': {'partial'},
    'array': {'array', '_array_reconstructor'},
}
_LIBRARIES = {
    'numpy': {'_reconstruct', 'ndarray', 'dtype', 'scalar', '_frombuffer'},
    'scipy': {'csr_matrix', 'csc_matrix', 'csr_array', 'csc_array'},
}


class _Unpickler(pickle.Unpickler):
    """Makes nothing but what a stage's state is made of."""

    def find_class(self, module: str, name: str):
        """The class or function of that name. Raises BadRecording for any other than those."""
        known = (name in _NAMES.get(module, ()) or module.startswith(_MODULES)
                 or name in _LIBRARIES.get(module.partition('.')[0], ()))
        if not known:
            raise BadRecording(f'stored state: {module}.{name} is no part of it; do not go on from it')
        return super().find_class(module, name)


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
