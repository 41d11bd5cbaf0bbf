# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
# Steps that are done once: each has a stamp file that holds the hash of what went into it. Sourced by build.bash.

# stamp_of FILE...: one hash over names and contents.
stamp_of() {
    sha256sum -- "$@" | sha256sum | cut -d' ' -f1
}

# is_done STEP HASH: true when the step ended with this very input.
is_done() {
    [[ -f $stamps/$1 && $(<"$stamps/$1") == "$2" ]]
}

# step NAME HASH TEXT COMMAND...: runs the command unless it is done, its output in a log, what is done and left shown now and then.
step() {
    local name=$1 hash=$2 text=$3 log=$logs/$1.log
    shift 3
    is_done "$name" "$hash" && return
    mkdir -p "$stamps" "$logs"
    rm -f "$stamps/$name"
    say "$text"
    local start=$SECONDS status
    # Not in a condition: there bash would continue after a command of the step that fails.
    set +e
    (set -e && "$@") 2>&1 </dev/null | tee "$log" | show_progress "${text%%:*}"
    status=${PIPESTATUS[0]}
    set -e
    ((status == 0)) || fail_step "$text" "$log"
    printf '%s' "$hash" >"$stamps/$name" || fail_step "$text" "$log"
    say "$text: done in $((SECONDS - start)) s"
}

# show_progress STEP: of a build the package at work and the percentage that is done, of an installer what is there; every five seconds.
show_progress() {
    local line package='' progress next=$((SECONDS + 5))
    while IFS= read -r line; do
        case $line in
            'Starting >>> '*) package=${line#*>>> } && continue ;;
            '['*%']'*) progress="$package ${line%%]*}]" ;;
            *Downloaded\ * | Prepared\ * | Installed\ *) progress=${line# } ;;
            *) continue ;;
        esac
        ((SECONDS < next)) && continue
        next=$((SECONDS + 5))
        printf '    %s: %s\n' "$1" "$progress" >&2
    done
}

# fail_step TEXT LOG: one line for causes that are known, else the end of the log.
fail_step() {
    local again="run it again to continue from here"
    if grep -qi 'no space left on device' "$2"; then
        fail "$1: the disk is full. Free 2 GB on $(df -P "$logs" | awk 'END { print $6 }') and where uv keeps its downloads, then $again."
    fi
    if grep -qiE 'failed to fetch|failed to download|no matching distribution|name resolution|new connection|timed out' "$2"; then
        fail "$1: PyPI cannot be reached. Check the network (and https_proxy), then $again. More is in $2"
    fi
    tail -n 40 "$2" >&2
    fail "$1: failed. The whole output is in $2; $again."
}

# step_beside NAME...: a step in the background, in a process group of its own; its process id is in $!.
step_beside() {
    set -m
    step "$@" &
    set +m
}

# end_children: what is in the background does not outlive the set-up.
end_children() {
    local child
    for child in $(jobs -p); do
        kill -- "-$child" 2>/dev/null || true
    done
}

say() {
    printf 'setup: %s\n' "$*" >&2
}

fail() {
    printf 'setup: %s\n' "$*" >&2
    exit 1
}
