# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sets up ROS for nodes of this process; any exception that no check foresaw is raised (see DefectGuard.strict)."""
import pytest
import rclpy


@pytest.fixture(scope='module', autouse=True)
def ros():
    rclpy.init()
    yield
    rclpy.try_shutdown()
