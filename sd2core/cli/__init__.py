"""The ``sd2`` command: one module per group of subcommands.

Building the parser imports nothing heavy; every handler imports what it needs.
"""

from sd2core.cli.parser import build_parser
from sd2core.cli.running import run

__all__ = ["build_parser", "run"]
