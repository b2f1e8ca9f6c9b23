"""Weights and a description of them in one safetensors file, read without executing anything."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.limits import check_regular

if TYPE_CHECKING:
    from torch import nn

SUFFIX = ".safetensors"

Shapes = Mapping[str, list[int]]
"""Shape of every tensor of a file."""

_KEY = "sd2"
_LONGEST_HEADER = 4 << 20
_ROOM, _TIMES = 10_000_000, 16
"""Numbers that may be made on the way to a network, and how often each of its own."""

Network = TypeVar("Network", bound="nn.Module")


def write_weights(path: Path, network: nn.Module, description: Mapping[str, Any]) -> None:
    """Write one file, in one step.

    Raises Sd2Error when the name does not end in ``.safetensors``, or the description holds what
    JSON cannot.
    """
    from safetensors.torch import save

    if path.suffix != SUFFIX:
        raise Sd2Error(f"The model file is {path}", f"a name that ends in {SUFFIX}")
    try:
        header = json.dumps(description, allow_nan=False, ensure_ascii=False)
    except (TypeError, ValueError) as error:
        raise Sd2Error(
            f"The description of the model cannot be written ({error})",
            "text, finite numbers, lists and mappings",
        ) from error
    tensors = {
        name: tensor.detach().cpu().contiguous() for name, tensor in network.state_dict().items()
    }
    with atomic_write(path) as stream:
        stream.write(save(tensors, {_KEY: header}))


def read_header(path: Path, expected: str) -> tuple[dict[str, Any], Shapes]:
    """Read description and shapes; the weights stay on disk, and torch is not needed.

    ``expected`` names the kind of file in messages. Raises Sd2Error when the file is missing,
    damaged, cut short or of another program.
    """
    check_regular(path)
    try:
        with path.open("rb") as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            start = stream.read(8)
            length = struct.unpack("<Q", start)[0] if len(start) == 8 else 0
            if not 2 <= length <= _LONGEST_HEADER:
                raise Sd2Error(f"{path} is no model file", expected)
            header = stream.read(length)
    except FileNotFoundError as error:
        raise Sd2Error(f"{path} does not exist", expected, "Check the path") from error
    except IsADirectoryError as error:
        raise Sd2Error(f"{path} is a folder", expected) from error
    if not header.startswith(b"{"):
        raise Sd2Error(f"{path} is no model file", expected)
    if len(header) < length:
        raise _cut_short(path, size, 8 + length)
    try:
        content = json.loads(header)
        metadata = content.pop("__metadata__", {})
        if not isinstance(metadata, Mapping) or _KEY not in metadata:
            raise Sd2Error(
                f"{path} is a safetensors file of another program: it does not say how its"
                " weights are to be used",
                expected,
            )
        shapes = {name: list(map(int, entry["shape"])) for name, entry in content.items()}
        end = max((int(entry["data_offsets"][1]) for entry in content.values()), default=0)
        description = json.loads(metadata[_KEY])
        if not isinstance(description, dict):
            raise ValueError("not an object")
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError) as error:
        raise Sd2Error(f"{path}: its header is damaged ({error!r})", expected) from error
    if size < 8 + length + end:
        raise _cut_short(path, size, 8 + length + end)
    if size > 8 + length + end:
        raise Sd2Error(
            f"{path} has {size:,} bytes",
            f"{8 + length + end:,} bytes, as its header says",
            "Copy or train it again",
        )
    return description, shapes


def format_of(path: Path) -> str:
    """Format named in a model file, or an empty string.

    Raises Sd2Error when it is no model file.
    """
    return str(read_header(path, "a model file (.safetensors)")[0].get("format", ""))


def read_network(
    path: Path, build: Callable[[], Network], name: str, shapes: Shapes, expected: str
) -> Network:
    """Build a network as a file describes it, and load its weights into it.

    Parameters
    ----------
    path : Path
        The model file.
    build : callable
        Makes the network; where it is larger than its file says, on torch's device without memory
        (``meta``), too.
    name : str
        Name of the model in the file, for messages.
    shapes : mapping
        From :func:`read_header`.
    expected : str
        Names the kind of file in messages.

    Raises
    ------
    Sd2Error
        If the network cannot be built, is not that of the weights, or they are not finite.
    """
    import torch
    from safetensors import SafetensorError
    from safetensors.torch import load

    try:
        planned = network = _built_within(
            build, _ROOM + _TIMES * sum(map(math.prod, shapes.values()))
        )
        if planned is None:
            # Shapes, without memory for what they would hold; torch loads its compiler for that.
            with torch.device("meta"):
                planned = build()
        wanted = {key: list(tensor.shape) for key, tensor in planned.state_dict().items()}
        _compare_shapes(path, name, shapes, wanted, expected)
        network = build() if network is None else network
    except Sd2Error as error:
        if str(path) in error.found:
            raise
        raise Sd2Error(
            f"{path}: {error.found}", error.expected, "The file may be of another version"
        ) from error
    try:
        weights = load(path.read_bytes())
    except (SafetensorError, ValueError, KeyError, RuntimeError) as error:
        raise Sd2Error(f"{path}: its weights cannot be read ({error})", expected) from error
    if not all(torch.isfinite(tensor).all() for tensor in weights.values()):
        raise Sd2Error(
            f"{path}: its weights hold NaN or infinity", "finite numbers", "Train the model again"
        )
    network.load_state_dict(weights)
    return network


def _built_within(build: Callable[[], Network], most: int) -> Network | None:
    """Network, unless more than so many numbers are made on the way."""
    import torch
    from torch.overrides import TorchFunctionMode

    class TooLargeError(Exception):
        """The numbers so far are too many."""

    class Counted(TorchFunctionMode):
        """Counts the numbers of every result, before anything is written to new ones."""

        made = 0

        def __torch_function__(
            self, function: Any, types: Any, args: Any = (), kwargs: Any = None
        ) -> Any:
            result = function(*args, **(kwargs or {}))
            if isinstance(result, torch.Tensor):
                self.made += result.numel()
                if self.made > most:
                    raise TooLargeError
            return result

    try:
        with Counted():
            return build()
    except (TooLargeError, MemoryError, RuntimeError):  # the last: torch found no room
        return None


def _cut_short(path: Path, size: int, expected: int) -> Sd2Error:
    return Sd2Error(
        f"{path} is cut short: {size:,} bytes", f"{expected:,} bytes", "Copy or train it again"
    )


def _compare_shapes(path: Path, name: str, shapes: Shapes, wanted: Shapes, expected: str) -> None:
    missing = [key for key in wanted if key not in shapes]
    unknown = [key for key in shapes if key not in wanted]
    if missing or unknown:
        which = f"lacks {missing[0]}" if missing else f"has {unknown[0]} in addition"
        raise Sd2Error(
            f"{path}: the weights are not those of the model {name} that it names; it {which}"
            f" ({len(missing)} missing, {len(unknown)} too many)",
            expected,
        )
    for key, shape in wanted.items():
        if shapes[key] != shape:
            raise Sd2Error(
                f"{path}: {key} is of shape {tuple(shapes[key])}",
                f"{tuple(shape)}, as its options say",
            )
