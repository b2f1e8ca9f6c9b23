#!/usr/bin/env bash
# Say how to have `sd2` at hand in the user's shell: with "always", or once after an installation.
set -euo pipefail
cd "$(dirname "$0")/.."

told=.venv/.told
if [ "${1:-}" != always ] && [ ! $told -ot .venv/.with-program ]; then exit 0; fi
touch $told

shell=${SHELL:-sh}
case ${shell##*/} in
    fish) line="source .venv/bin/activate.fish" ;;
    csh | tcsh) line="source .venv/bin/activate.csh" ;;
    bash | zsh) line="source .venv/bin/activate" ;;
    *) line=". .venv/bin/activate" ;;
esac
echo "To have sd2 at hand in this shell, type:  $line"
