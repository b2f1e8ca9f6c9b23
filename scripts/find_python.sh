#!/usr/bin/env bash
# Print the Python to use: $PYTHON, or the first on the path that is new enough.
set -euo pipefail

is_new_enough() {
    "$1" -c 'import sys; raise SystemExit(sys.version_info < (3, 11))' 2> /dev/null
}

if [ -n "${PYTHON:-}" ]; then
    if is_new_enough "$PYTHON"; then
        echo "$PYTHON"
        exit 0
    fi
    echo "PYTHON=$PYTHON is not a Python of version 3.11 or newer." >&2
    exit 1
fi
for candidate in python3 python3.13 python3.12 python3.11 python; do
    if is_new_enough "$candidate"; then
        echo "$candidate"
        exit 0
    fi
done
echo "Python 3.11 or newer is needed; python3 is: $(python3 --version 2>&1 || true)" >&2
echo "Install one, or name it: make setup PYTHON=/path/to/python3.11" >&2
exit 1
