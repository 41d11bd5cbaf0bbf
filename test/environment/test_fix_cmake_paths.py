# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wheel builder's include folders are replaced, all else stays."""

import importlib.util
import pathlib
import sysconfig

import numpy

PATH = pathlib.Path(__file__).resolve().parents[2] / 'environment' / 'fix_cmake_paths.py'


def test_both_include_folders_are_replaced():
    spec = importlib.util.spec_from_file_location('fix_cmake_paths', PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    prefix = '/opt/python/cp311-cp311'
    text = f'set(x "{prefix}/include/python3.11;{prefix}/lib/python3.11/site-packages/numpy/_core/include;/usr")'
    assert module.fix(text) == f'set(x "{sysconfig.get_paths()["include"]};{numpy.get_include()};/usr")'
