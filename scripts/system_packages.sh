#!/usr/bin/env bash
# Make sure that what pip cannot bring is there: Python's venv module, and the
# system libraries that Qt and VTK load.
#
# usage: scripts/system_packages.sh [tests]
#   tests    also what the tests on a virtual display need
#
# Installs with apt where it may (root, or sudo without a password); otherwise
# prints the line to type and fails.
set -euo pipefail
cd "$(dirname "$0")/.."

# What must be there = the Debian package that brings it.
DRAWING="libGL.so.1=libgl1 libEGL.so.1=libegl1 libgthread-2.0.so.0=libglib2.0-0
    libxkbcommon.so.0=libxkbcommon0 libdbus-1.so.3=libdbus-1-3 libfontconfig.so.1=libfontconfig1"
SCREEN="libX11-xcb.so.1=libx11-xcb1 libxcb-cursor.so.0=libxcb-cursor0
    libxcb-icccm.so.4=libxcb-icccm4 libxcb-keysyms.so.1=libxcb-keysyms1
    libxkbcommon-x11.so.0=libxkbcommon-x11-0 libxcb-randr.so.0=libxcb-randr0
    libxcb-shape.so.0=libxcb-shape0 libxcb-sync.so.1=libxcb-sync1
    libxcb-xfixes.so.0=libxcb-xfixes0"
WAYLAND="libwayland-client.so.0=libwayland-client0 libwayland-cursor.so.0=libwayland-cursor0"
VIRTUAL_SCREEN="xvfb-run=xvfb xauth=xauth"

missing=""
packages=""

note_missing() {
    missing+=" $1"
    packages+=" $2"
}

if ! .venv/bin/python -c '' 2> /dev/null; then
    python=$(scripts/find_python.sh)
    if ! "$python" -c 'import ensurepip, venv' 2> /dev/null; then
        # Debian splits this part of Python off.
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        note_missing "the venv module of $python" "python$version-venv"
    fi
fi

if [ "$(uname -s)" = Linux ]; then
    wanted=$DRAWING
    if [ "${1:-}" = tests ]; then
        wanted+=" $SCREEN $VIRTUAL_SCREEN"
    elif [ -n "${DISPLAY:-}" ]; then
        wanted+=" $SCREEN"
    elif [ -n "${WAYLAND_DISPLAY:-}" ]; then
        wanted+=" $WAYLAND"
    fi
    known=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
    for entry in $wanted; do
        thing=${entry%%=*}
        case $thing in
            *.so.*) case $known in *"$thing "*) continue ;; esac ;;
            *) if command -v "$thing" > /dev/null; then continue; fi ;;
        esac
        note_missing "$thing" "${entry#*=}"
    done
fi

[ -n "$missing" ] || exit 0

if ! command -v apt-get > /dev/null; then
    echo "These are missing:$missing" >&2
    echo "Install the packages of your system that bring them, then run make again." >&2
    exit 1
fi
if [ "$(id -u)" -eq 0 ]; then
    as_root=""
elif command -v sudo > /dev/null && sudo -n true 2> /dev/null; then
    as_root="sudo -n"
else
    echo "Some system packages are missing. Type this line, then run make again:" >&2
    echo >&2
    echo "    sudo apt-get update && sudo apt-get install --no-install-recommends$packages" >&2
    echo >&2
    exit 1
fi

echo "Installing system packages:$packages"
$as_root apt-get -q update < /dev/null
# shellcheck disable=SC2086  # one word per package
$as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends $packages < /dev/null
