#!/usr/bin/env bash
# Make .venv and install the pinned dependencies and this checkout into it.
set -euo pipefail
cd "$(dirname "$0")/.."

is_new_enough() {
    "$1" -c 'import sys; raise SystemExit(sys.version_info < (3, 11))' 2> /dev/null
}

find_python() {
    if [ -n "${PYTHON:-}" ]; then
        is_new_enough "$PYTHON" && { echo "$PYTHON"; return; }
        echo "PYTHON=$PYTHON is not a Python of version 3.11 or newer." >&2
        return 1
    fi
    for candidate in python3 python3.13 python3.12 python3.11 python; do
        if is_new_enough "$candidate"; then echo "$candidate"; return; fi
    done
    echo "Python 3.11 or newer is needed; \`python3\` is $(python3 --version 2>&1 || true)." >&2
    echo "Install one, or name it: make setup PYTHON=/path/to/python3.11" >&2
    return 1
}

if ! is_new_enough .venv/bin/python; then
    python=$(find_python)
    echo "Making .venv with $("$python" --version) …"
    if ! "$python" -c 'import ensurepip, venv' 2> /dev/null; then
        # Debian splits this part of Python off.
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        if ! command -v apt-get > /dev/null; then
            echo "This Python has no venv module. Install it, or name another: PYTHON=…" >&2
            exit 1
        fi
        scripts/apt_install.sh "python$version-venv"
    fi
    rm -rf .venv
    "$python" -m venv .venv
fi

echo "Installing the pinned dependencies …"
pip="env PIP_DISABLE_PIP_VERSION_CHECK=1 .venv/bin/python -m pip --no-input install --quiet"
# The build backend first, so that it is a pinned one too.
$pip --constraint constraints.txt hatchling editables < /dev/null
$pip --constraint constraints.txt --no-build-isolation --editable ".[dev]" < /dev/null
