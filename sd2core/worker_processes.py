"""What processes that work for another one have in common."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import threading


def end_with_parent() -> None:
    """End this process when the one that started it is gone, however that ended.

    A worker whose parent is killed outright would wait for work for ever. Call it first
    in a worker; it returns at once.
    """
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="sd2-parent", daemon=True).start()
