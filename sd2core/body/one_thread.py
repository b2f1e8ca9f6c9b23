"""Linear algebra on one thread."""

from __future__ import annotations

from contextlib import AbstractContextManager


def one_thread() -> AbstractContextManager[object]:
    """Until it is left, products and factorisations of this process use one thread.

    A fit consists of many small ones, which gain nothing from threads; beside other work
    threads that wait for each other made it seven times as slow.
    """
    # SciPy's own copy of the library is limited only once it is loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
