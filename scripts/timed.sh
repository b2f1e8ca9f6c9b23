#!/usr/bin/env bash
# Run a command as a named part, and note its time and exit code in the file named by SD2_TIMES.
#
# usage: scripts/timed.sh NAME COMMAND …    runs it; without SD2_TIMES nothing is noted
#        scripts/timed.sh --summary         prints what was noted
set -uo pipefail

if [ "$1" = --summary ]; then
    echo "== Times"
    while read -r seconds code name; do
        printf '%-28s %3d min %02d s' "$name" $((seconds / 60)) $((seconds % 60))
        if [ "$code" -eq 0 ]; then echo; else echo "  failed ($code)"; fi
    done < "$SD2_TIMES"
    exit 0
fi

name=$1
shift
began=$SECONDS
"$@"
code=$?
if [ -n "${SD2_TIMES:-}" ]; then echo "$((SECONDS - began)) $code $name" >> "$SD2_TIMES"; fi
exit $code
