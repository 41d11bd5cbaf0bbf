# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes of the drivers: the only place here that imports ROS.

A node is one thread: its matrices are small, so that a second thread of the linear algebra only waits (measured: seven times slower on
two busy cores). It has to be said before NumPy is imported, hence here.
"""
import os

for _name in ('OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS'):
    os.environ.setdefault(_name, '1')
