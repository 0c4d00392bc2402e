#!/usr/bin/env bash
# Checks what nbdtree.bash offers: completion.sh NBDTREE COMPLETION
set -euo pipefail
source "$2"
program=$1
offers() { # offers WORDS... : what the last word may become
    COMP_WORDS=("$program" "$@") COMP_CWORD=$#
    _nbdtree
    printf '%s ' "${COMPREPLY[@]}"
}
expect() { # expect TEXT WORDS...
    local text=$1 found
    shift
    found=$(offers "$@")
    [ "$found" = "$text " ] || { echo "'$*' offers '$found'; wanted: '$text'" >&2; exit 1; }
}
expect "modes" mo
expect "coverage collide" co
expect "--frames" simulate scene.json --fra
expect "--threads" simulate scene.json --thr
expect "midpoint" mesh a.obj --subdivision mid
expect "completion.sh" mesh completio
echo "completion offers what it should"
