# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes of the drivers: only this folder imports ROS.

Linear algebra and OpenCV run in one thread: matrices and images are small, and further threads only wait (measured: seven times slower on
two busy cores). OpenCV refuses to decode an image that is larger than any camera's, because a few bytes can claim any size. The libraries
read these variables when they are imported, so they are set here.
"""
import os

for _name in ('OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS', 'OPENCV_FOR_THREADS_NUM'):
    os.environ.setdefault(_name, '1')
os.environ.setdefault('OPENCV_IO_MAX_IMAGE_PIXELS', str(2**25))  # 100 MB in colour
