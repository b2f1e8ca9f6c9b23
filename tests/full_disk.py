"""A disk that is full: files grow up to so many bytes, and no further."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def full_disk(left_bytes: int = 1000) -> Iterator[None]:
    """Let no file of this process become longer; skip where the system cannot."""
    resource = pytest.importorskip("resource")
    before, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    # Or kept bytecode of what is imported for the first time would be cut off, for all who come.
    writes_no_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    resource.setrlimit(resource.RLIMIT_FSIZE, (left_bytes, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (before, most))
        sys.dont_write_bytecode = writes_no_bytecode
