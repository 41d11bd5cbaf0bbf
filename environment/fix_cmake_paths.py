# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""
Point the CMake files of the ROS 2 wheels at this interpreter.

Usage: python fix_cmake_paths.py VENV (with the venv's own python). The wheels carry the include folders of the machine that they
were built on, /opt/python/cp3XX-cp3XX/..., which CMake refuses because they do not exist.
"""

import pathlib
import re
import sys
import sysconfig

import numpy

NUMPY_INCLUDE = re.compile(r'/opt/python/cp3\d+-cp3\d+/lib/python3\.\d+/site-packages/numpy/_?core/include')
PYTHON_INCLUDE = re.compile(r'/opt/python/cp3\d+-cp3\d+/include/python3\.\d+')


def fix(text):
    """Return the text of a CMake file with the include folders of Python and NumPy replaced by this interpreter's."""
    text = NUMPY_INCLUDE.sub(lambda match: numpy.get_include(), text)
    return PYTHON_INCLUDE.sub(lambda match: sysconfig.get_paths()['include'], text)


def main():
    """Rewrite every CMake file below share/ of the venv that needs it."""
    for path in sorted(pathlib.Path(sys.argv[1], 'share').glob('*/cmake/*.cmake')):
        text = path.read_text()
        fixed = fix(text)
        if fixed != text:
            path.unlink()  # its other links, in the installer's cache, stay as they are
            path.write_text(fixed)


if __name__ == '__main__':
    main()
