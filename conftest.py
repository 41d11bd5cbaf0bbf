# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bind the packages' names before pytest does: it would take the source folders of the same names for them (import mode importlib).

The nodes' package comes first: it says, before NumPy is imported, with how many threads nodes and tools compute. With another number a
sum may differ in its last bit from theirs.

This process of pytest, and what it starts, has a ROS domain of its own, on this machine alone.
"""
import contextlib
import importlib
import importlib.util
import os
import pathlib
import sys

if 'numpy' in sys.modules and os.environ.get('OPENBLAS_NUM_THREADS') != '1':
    raise RuntimeError('a plugin of pytest imported NumPy before conftest.py could set its number of threads: exclude it in pytest.ini, '
                       'or set OPENBLAS_NUM_THREADS=1')

for name in ('tactile_driver.nodes', 'tactile_msgs.msg', 'tactile_perception', 'tactile_bringup'):
    with contextlib.suppress(ImportError):  # `colcon test` tests a package without those that are built on it
        importlib.import_module(name)

import pytest  # noqa: E402
from ros_domain import claimed  # noqa: E402

DOMAIN, _CLAIM = claimed()
os.environ.update(ROS_DOMAIN_ID=str(DOMAIN), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')

try:
    from tactile_driver.nodes.runtime.defect_guard import DefectGuard
except ImportError:  # there is no ROS, and no node
    pass
else:
    DefectGuard.strict = True

#: Where there is no ROS, the rules of style alone can be tested at the top level.
collect_ignore_glob = [] if importlib.util.find_spec('rclpy') else ['test/[!s]*', 'test/stability*']
TOP = pathlib.Path(__file__).resolve().parent / 'test'
#: What `make test` runs of the tests that need more than one package; all others of them have the marker `full`.
QUICK = (TOP / 'style', TOP / 'launch' / 'test_demo.py', TOP / 'docs' / 'test_runs.py')


def pytest_collection_modifyitems(config, items):
    """Mark what is left out of `make test`."""
    for item in items:
        if TOP in item.path.parents and not any(quick in (item.path, *item.path.parents) for quick in QUICK):
            item.add_marker(pytest.mark.full)
