#!/usr/bin/env bash
# Print the Python to use: $PYTHON, or the first on the path that the program supports.
set -euo pipefail

# As `requires-python` in pyproject.toml says.
is_supported() {
    "$1" -c 'import sys; raise SystemExit(not (3, 11) <= sys.version_info < (3, 15))' 2> /dev/null
}

if [ -n "${PYTHON:-}" ]; then
    if is_supported "$PYTHON"; then
        echo "$PYTHON"
        exit 0
    fi
    echo "PYTHON=$PYTHON is not a Python from 3.11 to 3.14." >&2
    exit 1
fi
for candidate in python3 python3.14 python3.13 python3.12 python3.11 python; do
    if is_supported "$candidate"; then
        echo "$candidate"
        exit 0
    fi
done
echo "Python 3.11, 3.12, 3.13 or 3.14 is needed; found: $(python3 --version 2>&1 || true)" >&2
echo "Where the system has another one (e.g. \`apt-get install python3.11 python3.11-venv\`)," >&2
echo "it is found by itself; elsewhere name it: make demo PYTHON=/path/to/python3.11" >&2
exit 1
