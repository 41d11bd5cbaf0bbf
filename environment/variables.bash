# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# The variables that make a virtual environment with the wheels of ROS 2 a ROS 2. Sourced by setup.bash and build.bash.

# set_ros_variables VENV: CMake finds the headers of pybind11 and Eigen in folders of their own among Python's packages.
set_ros_variables() {
    local site
    site=$(echo "$1"/lib/python3.*/site-packages)
    export VIRTUAL_ENV=$1 PATH=$1/bin:$PATH AMENT_PREFIX_PATH=$1 ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
    export CMAKE_PREFIX_PATH=$1:$site/pybind11:$site/cmeel.prefix${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}
}
