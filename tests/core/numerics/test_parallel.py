"""Work on the kernel threads that itself wants to be spread over them."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from sd2core.body.model import Body
from sd2core.body.skinning import pose_vertices
from sd2core.numerics.compiled import on_worker, worker_count
from sd2core.numerics.parallel import Ticket, run_jobs, spread
from sd2core.progress import silent


@pytest.mark.timeout(60)
def test_jobs_that_are_all_spread_again_do_not_wait_for_each_other() -> None:
    """Each kernel thread is in a job, as when one reads a mesh that is posed when it is read."""
    body, count = Body.load("low"), worker_count()
    rest = body.skeleton.transforms(
        np.tile(np.eye(3), (20, len(body.skeleton), 1, 1)), np.zeros((20, 3))
    )
    everybody, posed = threading.Barrier(count), []

    def job(ticket: Ticket) -> None:
        assert on_worker()
        everybody.wait()
        posed.append(pose_vertices(body, rest))
        assert [*spread(abs, (-1, 2))] == [1, 2]
        run_jobs([lambda inner: inner.advance(1)] * 3, 3, silent)
        ticket.advance(1)

    run_jobs([job] * count, count, silent)
    assert not on_worker()
    alone = pose_vertices(body, rest)
    assert len(posed) == count
    for vertices in posed:
        np.testing.assert_array_equal(vertices, alone)
