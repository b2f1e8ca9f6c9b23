#!/usr/bin/env bash
# Open the sample in the window, or draw the window into a picture where there is no display.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ "$(uname -s)" != Linux ] || [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}${QT_QPA_PLATFORM:-}" ]; then
    exec .venv/bin/sd2 demo
fi
mkdir -p build
echo "There is no display to open a window on, so the window is drawn into build/demo.png:"
echo ".venv/bin/sd2 demo --screenshot build/demo.png"
exec .venv/bin/sd2 demo --screenshot build/demo.png
