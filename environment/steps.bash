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

# step NAME HASH TEXT COMMAND...: runs the command unless it is done, its output in a log, its last line shown now and then.
step() {
    local name=$1 hash=$2 text=$3 log=$logs/$1.log
    shift 3
    is_done "$name" "$hash" && return
    mkdir -p "$stamps" "$logs"
    rm -f "$stamps/$name"
    say "$text"
    local start=$SECONDS status
    # Not in a condition: there bash would go on after a command of the step that fails.
    set +e
    (set -e && "$@") 2>&1 </dev/null | tee "$log" | show_progress
    status=${PIPESTATUS[0]}
    set -e
    if ((status)); then
        tail -n 40 "$log" >&2
        fail "$text: failed. The whole output is in $log; the next call starts again from here."
    fi
    printf '%s' "$hash" >"$stamps/$name"
    say "$text: done in $((SECONDS - start)) s"
}

# show_progress: of the lines that come in, one every five seconds.
show_progress() {
    local line next=$((SECONDS + 5))
    while IFS= read -r line; do
        ((SECONDS < next)) && continue
        next=$((SECONDS + 5))
        printf '    %s\n' "${line:0:110}" >&2
    done
}

say() {
    printf 'setup: %s\n' "$*" >&2
}

fail() {
    printf 'setup: %s\n' "$*" >&2
    exit 1
}
