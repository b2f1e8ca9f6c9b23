#!/usr/bin/env bash
# Make sure the system libraries are there that Qt and VTK load and pip cannot bring.
#
# usage: scripts/system_libraries.sh [window] [tests]
#   window   what the window needs, on a display or drawn into a picture
#   tests    also a virtual display, for tests that need one
#
# Installs with apt where it may (root, or sudo without a password); otherwise
# prints the line to type and fails.
set -euo pipefail

[ "$(uname -s)" = Linux ] || exit 0

# What must be there = the Debian package that brings it.
DRAWING="libGL.so.1=libgl1 libEGL.so.1=libegl1 libgthread-2.0.so.0=libglib2.0-0
    libxkbcommon.so.0=libxkbcommon0 libdbus-1.so.3=libdbus-1-3 libfontconfig.so.1=libfontconfig1"
DISPLAY_SERVER="libxcb-cursor.so.0=libxcb-cursor0 libxcb-icccm.so.4=libxcb-icccm4
    libxcb-keysyms.so.1=libxcb-keysyms1 libxkbcommon-x11.so.0=libxkbcommon-x11-0
    libxcb-shape.so.0=libxcb-shape0"
VIRTUAL_DISPLAY="xvfb-run=xvfb xauth=xauth"

wanted=""
for purpose in "$@"; do
    case $purpose in
        window)
            wanted+=" $DRAWING"
            if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then wanted+=" $DISPLAY_SERVER"; fi
            ;;
        tests) wanted+=" $DRAWING $DISPLAY_SERVER $VIRTUAL_DISPLAY" ;;
        *) echo "unknown purpose $purpose" >&2; exit 2 ;;
    esac
done

known=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
missing=""
packages=""
for entry in $wanted; do
    thing=${entry%%=*}
    case $thing in
        *.so.*) case $known in *"$thing "*) continue ;; esac ;;
        *) if command -v "$thing" > /dev/null; then continue; fi ;;
    esac
    case " $missing " in *" $thing "*) continue ;; esac
    missing+=" $thing"
    packages+=" ${entry#*=}"
done
[ -n "$missing" ] || exit 0

if ! command -v apt-get > /dev/null; then
    echo "These system libraries and programs are missing:$missing" >&2
    echo "Install the packages of your system that bring them, then run this again." >&2
    exit 1
fi

"$(dirname "$0")/apt_install.sh" $packages
