#!/usr/bin/env bash
# Install Debian packages where that is possible without asking; otherwise say what to type.
#
# usage: scripts/apt_install.sh PACKAGE...
set -euo pipefail

if [ "$(id -u)" -eq 0 ]; then
    as_root=""
elif command -v sudo > /dev/null && sudo -n true 2> /dev/null; then
    as_root="sudo -n"
else
    echo "Some system packages are missing. Type this line, then run make again:" >&2
    echo >&2
    echo "    sudo apt-get update && sudo apt-get install --no-install-recommends $*" >&2
    echo >&2
    exit 1
fi

echo "Installing system packages: $*"
$as_root apt-get -q update < /dev/null
$as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get -q install -y --no-install-recommends "$@" < /dev/null
