"""``sd2 labels set``: print, export or replace the label set of a file."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.command_parser import command
from sd2core.cli.labels.reading import LabelFile, check_label_output, print_lost, read_named, write
from sd2core.cli.output import counted, print_json, print_rows
from sd2core.options.records import OptionError
from sd2core.options.shared import Json, Overwrite

if TYPE_CHECKING:
    from sd2core.labels.spans import Labels


class Set(LabelFile, Overwrite, Json):
    """Options of ``sd2 labels set``.

    Parameters
    ----------
    export : FILE.json
        write the set by itself
    use : FILE.json
        another set; 'usual' is the program's own
    out : FILE
        where to write the labels with that other set
    """

    export: Path | None = None
    use: str | None = None
    out: Path | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.use is None) != (self.out is None):
            raise OptionError("One of --use and --out is given", "both of them, or none")


@command("set", Set)
def _set(options: Set) -> None:
    """Show, share or exchange a label set.

    Prints the labels with key, colour, class for the classifier and how many spans have
    them, and labels whose colours look alike. With --use spans keep their labels, also
    those that the other set does not have.

      sd2 labels set walk.sd2
      sd2 labels set walk.sd2 --export gestures.json
      sd2 labels set walk.sd2 --use gestures.json --out labels.json
    """
    from sd2core.labels import files
    from sd2core.labels.field_edits import set_label_set
    from sd2core.labels.label_set import GESTURES

    digests = {
        path: check_label_output(path) for path in (options.export, options.out) if path is not None
    }
    labels, clock = read_named(options)
    written, lost = [], []
    if options.use is not None and options.out is not None:
        usual = options.use == "usual"
        other = GESTURES if usual else files.read_label_set(Path(options.use))
        labels = set_label_set(labels, other).labels
        lost = write(options.out, labels, clock, over=digests[options.out])
        written.append(options.out)
    if options.export is not None:
        files.write_label_set(options.export, labels.label_set)
        written.append(options.export)
    if options.json:
        print_json(_data(labels) | {"written": [str(path) for path in written], "not_kept": lost})
        return
    for path in written:
        print(f"Wrote {path} with {counted(len(labels.label_set.labels), 'label')}")
    print_lost(lost)
    if not written:
        _print(labels)


def _print(labels: Labels) -> None:
    data = _data(labels)
    print(data["name"])
    rows = [("label", "key", "colour", "class", "spans")]
    rows += [
        (one["name"], one["key"], one["colour"], one["gesture_class"], str(one["spans"]))
        for one in data["labels"]
    ]
    print_rows(rows, right=(4,))
    for sentence in data["alike"]:
        print(f"{sentence}.")


def _data(labels: Labels) -> dict[str, Any]:
    from sd2core.labels.colours import alike
    from sd2core.labels.entries import label_set_entry

    spans = Counter(span.label for span in labels.spans)
    entry = label_set_entry(labels.label_set)
    for one in entry["labels"]:
        one["spans"] = spans[one["name"]]
    return entry | {"alike": [pair.words() for pair in alike(labels.label_set.labels)]}
