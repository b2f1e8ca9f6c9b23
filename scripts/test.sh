#!/usr/bin/env bash
# Run the tests of a marker expression, e.g. "not slow"; they need no display.
set -uo pipefail
cd "$(dirname "$0")/.."

# Small products and pictures gain nothing from threads, and threads that wait for each other cost much
# when the machine does other work.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 LP_NUM_THREADS=0
# Without kept bytecode every worker and every process that a test starts compiles every module,
# and pytest rewrites the assertions of every test file.
unset PYTHONDONTWRITEBYTECODE
# Tests write and delete thousands of files, and wait for them to be on disk: in memory where
# there is room for them.
ROOM_KB=3000000
if [ -w /dev/shm ] && [ "$(df --output=avail /dev/shm | tail -n 1)" -gt $ROOM_KB ]; then
    export TMPDIR=/dev/shm
fi
# One more than there are cores, as tests wait a sixth of their time, for files and for events.
# Neighbours stay together, so that what a file shares is made once; a worker that has nothing
# left takes half of what another has still to do.
side_by_side="-n $(($(getconf _NPROCESSORS_ONLN) + 1)) --maxprocesses 4 --dist worksteal"
# Benchmarks are skipped here (see addopts); importing them would take longer than many tests.
without="--ignore=tests/benchmarks"

export QT_QPA_PLATFORM=offscreen
exec .venv/bin/python -m pytest $side_by_side $without -m "$1" < /dev/null
