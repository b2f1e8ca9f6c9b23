"""What ``sd2 batch --dry-run`` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sd2core.cli.output import counted, duration, print_rows

if TYPE_CHECKING:
    from sd2core.batch.estimate import BatchEstimate
    from sd2core.batch.plan import BatchPlan

_LISTED = 5


def print_estimate(made: BatchEstimate, plan: BatchPlan) -> None:
    """Print tasks, hours and bytes."""
    print(
        f"{plan.out}: {counted(made.recordings, 'recording')},"
        f" {counted(plan.placement_count, 'placement')} each"
    )
    rows = [("step", "to do", "there", "one process", "written", "how long is")]
    for step, one in made.steps.items():
        rows.append(
            (
                step,
                f"{one.to_do:,}",
                f"{one.there:,}",
                duration(one.seconds),
                bytes_words(one.bytes),
                one.basis if one.to_do else "",
            )
        )
    print_rows(rows, right=(1, 2, 3, 4))
    workers = "1 process" if made.workers == 1 else f"{made.workers} processes"
    print(
        f"Estimated: {duration(made.hours * 3600)} on {workers}, {bytes_words(made.bytes)};"
        " some seconds more to start them"
    )
    if made.assumed_share > 0:
        print(
            f"{made.assumed_share:.0%} of that rests on another machine's figures: `sd2 fit` on a"
            " video of yours gives your own."
        )
    if made.looked_at < made.recordings:
        print(f"From {made.looked_at:,} recordings; the others are taken to be like them.")
    if made.unusable:
        print(f"{counted(len(made.unusable), 'recording')} of those looked at cannot be used:")
        for words in made.unusable[:_LISTED]:
            print(f"  {words}")


def bytes_words(size: float) -> str:
    """Such as ``1.2 GB``."""
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:,.3g} TB"
