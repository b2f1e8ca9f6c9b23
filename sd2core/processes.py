"""What processes that work for another one have in common."""

from __future__ import annotations

import os
import threading

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
"""Environment in which a process multiplies matrices on one thread, whichever library does it."""


def end_with_parent() -> None:
    """End this process when the one that started it is gone, however that ended.

    A worker whose parent is killed outright would wait for work for ever. Call it first
    in a worker; it returns at once.
    """
    # The window reads the constant above and starts no workers of this kind.
    import multiprocessing.connection

    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="sd2-parent", daemon=True).start()
