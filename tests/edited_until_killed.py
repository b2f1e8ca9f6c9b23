"""Edits labels in a process that is killed at a random moment, again and again.

``edited_until_killed.py FOLDER KILLS`` forks a process that edits on from where the one
before it was killed, tells every edit that has returned, and is killed. What the journal
then holds must be the labels after the last edit that was told, or after the one in progress.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from pathlib import Path

from labelled import even, imported, random_edit

from sd2core.labels.recovery import Recoverable, RecoveryPlace, offers_in
from sd2core.labels.spans import Labels

FRAMES = even()
START = imported(FRAMES, 7)
LONGEST_S = 0.03


def after(labels: Labels, number: int) -> Labels:
    """What edit ``number`` makes of labels."""
    return random_edit(labels, FRAMES, random.Random(number)).labels


def edit_on(root: Path, told: int) -> None:
    """Take the place, recover what is there, edit for ever and tell each edit."""
    place = RecoveryPlace(root, root / "walk.sd2")
    assert place.take(), place.holder()
    offers = place.offers().offers
    labels = offers[0].labels if offers else START
    session = place.begin(labels, offers[0] if offers else None)
    while True:
        number = session.kept.edits
        labels = after(labels, number)
        session.write("Edit", labels)
        os.write(told, b"%d\n" % (number + 1))


def left_behind(root: Path) -> Recoverable | None:
    """What is offered now that nobody edits."""
    offers = offers_in(root).offers
    return offers[0] if offers else None


def main(root: Path, kills: int) -> None:
    """Kill, and compare."""
    rng = random.Random(1)
    labels, edits = START, 0
    for _ in range(kills):
        hear, tell = os.pipe()
        process = os.fork()
        if process == 0:
            os.close(hear)
            edit_on(root, tell)
        os.close(tell)
        # A third die on their way to the first edit, the others after it.
        heard = b"" if rng.random() < 0.33 else os.read(hear, 4096)
        time.sleep(rng.uniform(0, LONGEST_S))
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        with os.fdopen(hear, "rb") as stream:
            told = [int(line) for line in (heard + stream.read()).split()]
        offer = left_behind(root)
        found = offer.edits if offer else 0
        expected = told[-1] if told else edits
        assert found in (expected, expected + 1), f"{found} edits, {expected} were told"
        for number in range(edits, found):
            labels = after(labels, number)
        assert offer is None or offer.labels == labels, f"other labels after {found} edits"
        edits = found
    assert len(list(root.rglob("*.tmp"))) <= 2, "leftovers pile up"
    print(f"{kills} kills {edits} edits")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
