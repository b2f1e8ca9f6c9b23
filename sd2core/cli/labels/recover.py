"""``sd2 labels recover``: labels that were not saved when a window ended."""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.labels.reading import check_label_output
from sd2core.cli.output import Report, counted, picked, print_rows
from sd2core.errors import Sd2Error
from sd2core.options.records import ARGUMENT, OptionError
from sd2core.options.shared import Json, Overwrite

if TYPE_CHECKING:
    from sd2core.labels.recovery import Recoverable


class Recover(Overwrite, Json):
    """Options of ``sd2 labels recover``.

    Parameters
    ----------
    recording : RECORDING
        the labelled recording, or a video that was not saved as one yet
    out : FILE.json
        write the newest of RECORDING, for `convert`
    """

    recording: Annotated[Path | None, ARGUMENT] = None
    out: Path | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.out is None:
            return
        if self.recording is None:
            raise OptionError(
                "--out was given without RECORDING", "a recording whose labels are written"
            )
        if self.out.suffix.lower() != ".json":
            raise OptionError(
                f"{self.out} is no .json", "a .json", "`sd2 labels convert` makes other files of it"
            )


@command("recover", Recover)
def _recover(options: Recover) -> Report:
    """List labels that were not saved when a window ended, or write them to a file.

    Opening the recording in the window offers them as well. Nothing is deleted here,
    and what a window edits now is not listed.

      sd2 labels recover
      sd2 labels recover walk.sd2 --out found.json
    """
    from sd2core.labels.recovery import offers_in, recovery_folder

    unsaved = offers_in(recovery_folder(), declined=True)
    offers = unsaved.offers
    if options.recording is not None:
        path = options.recording.resolve()
        offers = tuple(one for one in offers if one.recording == path)
    for note in unsaved.notes:
        print(note, file=sys.stderr)
    if options.out is not None:
        return _write(options.out, options, offers)
    data = {"recoveries": [_data(offer) for offer in offers]}
    say = partial(_print, offers) if offers else None
    return Report("There is nothing to recover.", data, say=say)


def _write(out: Path, options: Recover, offers: tuple[Recoverable, ...]) -> Report:
    from sd2core.labels.files import write_labels

    if not offers:
        raise Sd2Error(
            f"There is nothing to recover of {options.recording}",
            "one of those that `sd2 labels recover` lists",
        )
    check_label_output(out)
    write_labels(out, offers[0].labels, recording=offers[0].recording)
    title = f"Wrote {out} with {counted(len(offers[0].labels.spans), 'span')}"
    return Report(title, {"path": str(out)} | _data(offers[0]))


def _print(offers: tuple[Recoverable, ...]) -> None:
    rows = [("until", "edits", "last edit", "spans", "", "recording")]
    rows += [
        (
            time.strftime("%Y-%m-%d %H:%M", time.localtime(one.time_unix_s)),
            f"{one.edits:,}",
            one.last,
            f"{len(one.labels.spans):,}",
            "discarded" if one.declined else "",
            str(one.recording),
        )
        for one in offers
    ]
    print_rows(rows, right=(1, 3))


def _data(offer: Recoverable) -> dict[str, Any]:
    return {
        "recording": str(offer.recording),
        **picked(offer, "edits", "last", "time_unix_s"),
        "spans": len(offer.labels.spans),
        "discarded": offer.declined,
    }
