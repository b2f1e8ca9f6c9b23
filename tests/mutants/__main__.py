"""Mutants of every kind, tried from the command line."""

from __future__ import annotations

import argparse

import tests.mutants
from tests.mutants import TARGETS
from tests.mutants.running import originals, tried


def main() -> int:
    """Try mutants of every kind and print a table; 1 if any was not handled."""
    parser = argparse.ArgumentParser(description=tests.mutants.__doc__)
    parser.add_argument("--count", type=int, default=10_000, help="mutants, of all kinds together")
    parser.add_argument("--seed", type=int, default=0, help="the first one's")
    parser.add_argument("names", nargs="*", help="kinds of files, all by default", default=TARGETS)
    options = parser.parse_args()
    each = -(-options.count // len(options.names))
    failures: list[str] = []
    columns = "".join(f"{one:>8}" for one in ("mutants", "read", "refused", "failed", "crashed"))
    print(f"{'file':20}{columns}  slowest  largest")
    with originals(options.names) as folder:
        for name in options.names:
            seeds = range(options.seed, options.seed + each)
            tally = tried([(name, seed) for seed in seeds], folder)[name]
            counts = (tally.outcomes[one] for one in ("read", "refused", "failed", "crashed"))
            row = "".join(f"{count:8}" for count in (each, *counts))
            print(
                f"{name:20}{row}  {tally.slowest_s:5.1f} s  {tally.largest_bytes / 1e6:4.0f} MB",
                flush=True,
            )
            failures += tally.failures
    print(*failures, sep="\n")
    return 1 if failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
