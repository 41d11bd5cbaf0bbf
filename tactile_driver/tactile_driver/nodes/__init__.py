# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes of the drivers: the only place here that imports ROS.

A node is one thread: its matrices and images are small, so that a second thread of the linear algebra or of OpenCV only waits (measured:
seven times slower on two busy cores). It has to be said before they are imported, hence here.
"""
import os

for _name in ('OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS', 'OPENCV_FOR_THREADS_NUM'):
    os.environ.setdefault(_name, '1')
