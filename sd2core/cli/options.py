"""Options and argument types that several subcommands share."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any


def add_command(
    commands: argparse._SubParsersAction,
    name: str,
    summary: str,
    *,
    handler: Callable[[argparse.Namespace], int | None] | None = None,
    description: str = "",
    examples: str = "",
) -> argparse.ArgumentParser:
    """Add a subcommand with its help."""
    text = f"{summary[0].upper()}{summary[1:]}."
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{text}\n\n{description}".strip(),
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    if handler is not None:
        parser.set_defaults(handler=handler)
    return parser


def add_value(
    parser: argparse._ActionsContainer,
    name: str,
    kind: Callable[[str], Any],
    metavar: str,
    text: str,
    default: float | None = None,
) -> None:
    """Add an option or an argument with a value; a default is said after the text."""
    if default is not None:
        text = f"{text} (default: {default:g})"
    parser.add_argument(name, type=kind, metavar=metavar, default=default, help=text)


def add_json(parser: argparse._ActionsContainer) -> None:
    """Add ``--json``."""
    parser.add_argument(
        "--json", action="store_true", help="print JSON, for other programs; an error as well"
    )


def add_json_and_progress(parser: argparse.ArgumentParser) -> None:
    """Add ``--json`` and ``--progress-json``, of which one may be given."""
    group = parser.add_mutually_exclusive_group()
    add_json(group)
    group.add_argument(
        "--progress-json",
        action="store_true",
        help="print progress as JSON lines, for other programs (docs/formats.md)",
    )


def add_axis(parser: argparse._ActionsContainer) -> None:
    """Add the velocity axis."""
    add_value(parser, "--bins", positive_int, "N", "velocity bins (default: 32)")
    add_value(
        parser, "--v-max", positive_float, "MPS", "end of the velocity axis in m/s (default: 2)"
    )


def add_mesh_and_sensor(parser: argparse.ArgumentParser) -> None:
    """Add what is looked at, and from where."""
    add_value(parser, "mesh", Path, "MESH", "a mesh, or a recording")
    add_sensor(parser)


def add_output(
    parser: argparse._ActionsContainer, metavar: str, text: str, *, required: bool = True
) -> None:
    """Add ``--out``."""
    parser.add_argument("--out", type=Path, required=required, metavar=metavar, help=text)


def add_figure_output(parser: argparse._ActionsContainer, drawn: str) -> None:
    """Add ``--figure``."""
    add_value(parser, "--figure", Path, "FILE", f"draw {drawn}, as .png, .svg or .pdf")


def add_map_output(parser: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add ``--out`` for a Doppler map."""
    add_output(parser, "FILE.npz", "the map to write", required=required)


def add_sensor(parser: argparse.ArgumentParser) -> None:
    """Add ``--sensor``."""
    parser.add_argument(
        "--sensor",
        type=position,
        metavar="X,Y,Z",
        help="where the radar is, in metres (default: the recording's sensor, or the camera)",
    )


def add_mesh_reading(parser: argparse.ArgumentParser) -> None:
    """Add what a mesh file may not say about itself."""
    group = parser.add_argument_group("mesh file", "what it may not say about itself")
    group.add_argument(
        "--faces",
        type=Path,
        metavar="FILE",
        help="triangles (.npy or .obj) for a mesh that has none of its own",
    )
    add_value(
        group, "--fps", positive_float, "FPS", "frames per second of a mesh that does not say"
    )
    group.add_argument(
        "--scale",
        type=positive_float,
        metavar="M",
        help="metres per unit of the mesh, e.g. 0.001 for millimetres (default: 1)",
    )
    group.add_argument(
        "--person", metavar="ID", help="which person of a file of several (default: seen longest)"
    )
    group.add_argument(
        "--distance-m",
        type=finite_float,
        metavar="M",
        help="move a mesh that is centred on the body's root this far forward",
    )
    group.add_argument(
        "--image-size",
        type=image_size,
        metavar="WxH",
        help="size of the video in pixels, to place the output of VIBE (default: that of the"
        " recording's video)",
    )
    group.add_argument(
        "--focal-px",
        type=positive_float,
        metavar="PX",
        help="focal length of the video in pixels, likewise (default: the diagonal)",
    )


def add_channel(parser: argparse._ActionsContainer) -> None:
    """Add ``--receiver`` and ``--transmitter``."""
    parser.add_argument(
        "--receiver",
        type=positive_int,
        metavar="N",
        help="take this receiver, counted from 1 (default: the mean power of all)",
    )
    add_value(parser, "--transmitter", positive_int, "N", "take this transmitter, likewise")


def add_method(parser: argparse._ActionsContainer, text: str) -> None:
    """Add ``--method``: counting vertices, or the signal of a radar."""
    parser.add_argument(
        "--method",
        choices=("histogram", "fmcw"),
        default="histogram",
        help=f"{text} (default: histogram)",
    )


def add_placements_used(parser: argparse._ActionsContainer, what: str, usual: str) -> None:
    """Add ``--placements``: which places of the sensor are used of data that has several."""
    parser.add_argument(
        "--placements",
        choices=("all", "first"),
        default=usual,
        help=f"{what} all places of the sensor, or the first only (default: {usual})",
    )


def add_count(parser: argparse._ActionsContainer) -> None:
    """Add ``--count``."""
    parser.add_argument(
        "--count",
        choices=("expected", "plain"),
        help="count a vertex as badly known as its mesh says its velocity to be, or in one bin"
        " (default: expected)",
    )


def given(options: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Those of the named options that the command has and the user gave."""
    values = {name: getattr(options, name, None) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def flag(name: str) -> str:
    """Option of a name as it is typed: ``--v-max`` of ``v_max``."""
    return f"--{name.replace('_', '-')}"


def position(text: str) -> tuple[float, float, float]:
    """Parse ``X,Y,Z`` in metres."""
    values = _numbers(text)
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z in metres, e.g. -1,0,2.5")
    return values[0], values[1], values[2]


def vector(text: str) -> tuple[float, float, float]:
    """Parse ``X,Y,Z`` of any unit."""
    values = _numbers(text)
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z, e.g. 0,-1,0")
    return values[0], values[1], values[2]


def image_size(text: str) -> tuple[int, int]:
    """Parse ``WxH`` in pixels."""
    match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size in pixels, e.g. 640x480")
    return int(match[1]), int(match[2])


def span_m(text: str) -> tuple[float, float]:
    """Parse ``LO,HI`` in metres."""
    values = _numbers(text)
    if len(values) != 2 or not 0 <= values[0] < values[1]:
        raise argparse.ArgumentTypeError(f"{text!r} is not LO,HI in metres, e.g. 0.5,4")
    return values[0], values[1]


def name_list(text: str) -> tuple[str, ...]:
    """Parse ``anna,ben`` or ``none``."""
    if text == "none":
        return ()
    return tuple(name.strip() for name in text.split(",") if name.strip())


def add_limbs(parser: argparse._ActionsContainer) -> None:
    """Add ``--limbs``."""
    parser.add_argument(
        "--limbs",
        action="store_true",
        help="also keep the synthetic map of each part of the body (trunk, upper arms, forearms,"
        " thighs, lower legs)",
    )


def add_people_kept_out(group: argparse._ActionsContainer, validation: str, test: str) -> None:
    """Add ``--validation-subjects`` and ``--test-subjects``; the texts say who else it is."""
    for part, help_text in (("validation", validation), ("test", test)):
        add_value(group, f"--{part}-subjects", name_list, "LIST", help_text)


def bin_list(text: str) -> tuple[int, ...]:
    """Parse ``14,15,16`` or ``none``."""
    if text == "none":
        return ()
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither bin numbers such as 14,15,16 nor none"
        ) from None


def positive_int(text: str) -> int:
    """Parse a whole number above 0."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number above 0")
    return value


def finite_float(text: str) -> float:
    """Parse a number."""
    return _numbers(text, single=True)[0]


def positive_float(text: str) -> float:
    """Parse a number above 0."""
    value = finite_float(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


def share(text: str) -> float:
    """Parse a share above 0 and up to 1, as ``2%`` or ``0.02``."""
    try:
        value = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        value = math.nan
    if not 0 < value <= 1:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a share above 0 and up to 100%, e.g. 2% or 0.02"
        )
    return value


def not_negative_float(text: str) -> float:
    """Parse a number from 0 on."""
    value = finite_float(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text!r} is below 0")
    return value


def _numbers(text: str, *, single: bool = False) -> list[float]:
    parts = [text] if single else text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(value) for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number" + ("" if single else " list"))
    return values
