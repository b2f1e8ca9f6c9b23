#!/usr/bin/env bash
# Run the tests of a marker expression, e.g. "not slow": first those that need no
# display, then those that need one, on a virtual one. Fails when either part does.
set -uo pipefail
cd "$(dirname "$0")/.."

NO_TESTS_COLLECTED=5
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
pytest=".venv/bin/python -m pytest"
# One more than there are cores, as tests wait a sixth of their time, for files and for events.
# Neighbours stay together, so that what a file shares is made once; a worker that has nothing
# left takes half of what another has still to do.
side_by_side="-n $(($(getconf _NPROCESSORS_ONLN) + 1)) --maxprocesses 4 --dist worksteal"
# Only these are read for the second part.
on_display=$(grep -rl --include='test_*.py' 'pytest\.mark\.gl' tests)
expression=$1
# Benchmarks are skipped here (see addopts); importing them would take longer than many tests.
without="--ignore=tests/benchmarks"

echo "== Tests without a display"
QT_QPA_PLATFORM=offscreen scripts/timed.sh "tests without a display" \
    $pytest $side_by_side $without -m "($expression) and not gl" < /dev/null
offscreen=$?

echo "== Tests on a display"
scripts/timed.sh "tests on a display" scripts/on_display.sh $pytest -m "($expression) and gl" $on_display < /dev/null
display=$?
if [ $display -eq $NO_TESTS_COLLECTED ]; then display=0; fi

if [ $offscreen -ne 0 ]; then exit $offscreen; fi
exit $display
