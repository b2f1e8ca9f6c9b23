#!/usr/bin/env bash
# Make .venv and install the pinned dependencies and this checkout into it.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! .venv/bin/python -m pip --version > /dev/null 2>&1; then
    python=$(scripts/find_python.sh)
    echo "Making .venv with $("$python" --version)"
    rm -rf .venv
    "$python" -m venv .venv
fi

install="env PIP_DISABLE_PIP_VERSION_CHECK=1 .venv/bin/python -m pip --no-input install --quiet"
echo "Installing the pinned dependencies (3 GB on disk, once)"
# The build backend first, so that it is a pinned one too.
$install --constraint constraints.txt hatchling editables < /dev/null
$install --constraint constraints.txt --no-build-isolation --editable ".[dev]" < /dev/null
