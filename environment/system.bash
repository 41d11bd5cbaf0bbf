# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# What has to be on the machine before anything else: a Python in range, a compiler, cmake. Sourced by build.bash.

# usable_python COMMAND: true when it is CPython 3.10 to 3.13.
usable_python() {
    command -v "$1" >/dev/null &&
        "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null
}

# python_complete COMMAND: true when it can make a virtual environment and has the headers that extensions are built with.
python_complete() {
    "$1" -c 'import ensurepip, os, sys, sysconfig, venv
sys.exit(not os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h")))' 2>/dev/null
}

# find_python: prints the first interpreter in range, TACTILE_PYTHON before all others.
find_python() {
    local candidate
    for candidate in ${TACTILE_PYTHON:-} python3 python3.12 python3.11 python3.13 python3.10; do
        if usable_python "$candidate"; then
            "$candidate" -c 'import sys; print(sys.executable)'
            return
        fi
    done
    return 1
}

# missing_packages: prints the Debian names of what is not there.
missing_packages() {
    local python version
    command -v g++ >/dev/null || echo g++
    command -v cmake >/dev/null || echo cmake
    command -v make >/dev/null || echo make
    if ! python=$(find_python); then
        command -v python3 >/dev/null || echo python3 python3-venv python3-dev
    elif ! python_complete "$python"; then
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        echo "python$version-venv" "python$version-dev"
    fi
}

# require_system: installs what is missing where it may, else names the line to type and ends.
require_system() {
    [[ $(uname -s)-$(uname -m) == Linux-x86_64 ]] ||
        fail "the ROS 2 wheels of PyPI are for Linux on x86-64 only. Install ROS 2 Jazzy, source its setup.bash, and call this again."
    local missing
    if command -v python3 >/dev/null && ! find_python >/dev/null; then
        fail "$(python3 -V 2>&1) is not among those that ROS 2's wheels are for, 3.10 to 3.13." \
            "Install one of them and name it: TACTILE_PYTHON=python3.12 source setup.bash"
    fi
    missing=$(missing_packages | tr '\n' ' ')
    [[ -z $missing ]] && return
    if command -v apt-get >/dev/null && [[ $(id -u) == 0 ]]; then
        say "installing system packages: $missing"
        # shellcheck disable=SC2086
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $missing >/dev/null ||
            fail "apt-get could not install: $missing"
        missing=$(missing_packages | tr '\n' ' ')
        [[ -z $missing ]] && return
        fail "still missing after apt-get: $missing"
    fi
    if command -v apt-get >/dev/null; then
        fail "system packages are missing. Type: sudo apt-get install -y $missing"
    fi
    fail "missing on this machine, by their Debian names: $missing(install them with its package manager)"
}

# require_compiler: messages and kernels are compiled; names the line to type where that cannot be.
require_compiler() {
    local compiler=${CXX:-g++}
    command -v "${compiler%% *}" >/dev/null && return
    if command -v apt-get >/dev/null; then
        fail "there is no C++ compiler (${compiler%% *}). Type: sudo apt-get install -y g++"
    fi
    fail "there is no C++ compiler (${compiler%% *}); install g++ with this machine's package manager"
}

# free_megabytes PATH: on the disk that holds it.
free_megabytes() {
    df -Pm "$1" | awk 'END { print $4 }'
}

# require_space PATH: of the environment, and of downloads before they are unpacked.
require_space() {
    local free
    free=$(free_megabytes "$1")
    ((free >= 1500)) || fail "$free MB are free in $1, 1500 are needed. Free some, then call this again."
}
