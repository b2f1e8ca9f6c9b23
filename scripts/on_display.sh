#!/usr/bin/env bash
# Run a command on a virtual display of its own, where there are such displays.
#
# usage: scripts/on_display.sh COMMAND [ARGUMENT...]
set -euo pipefail

if [ "$(uname -s)" = Linux ]; then
    export QT_QPA_PLATFORM=xcb
    exec xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" "$@"
fi
exec "$@"
