"""``sd2 align``: the offset of a radar's clock, from what mesh and radar saw."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.output import print_facts, print_json
from sd2core.errors import Sd2Error
from sd2core.options.bounds import RADAR_SEARCH_S
from sd2core.options.records import ARGUMENTS, OptionError
from sd2core.options.shared import Json

if TYPE_CHECKING:
    from sd2core.doppler.alignment import Alignment
    from sd2core.recording.recording import Recording


class Align(Json):
    """Options of ``sd2 align``.

    Parameters
    ----------
    recordings : RECORDING
        with a mesh and a radar
    within : S
        search so far before and after the recording's offset, 2 s at least (default: 5)
    by_arrival
        by when frames of both arrived, as `sd2 record` has kept it: puts right an offset that was
        changed, or delays that were wrong
    camera_delay_ms : MS
        with --by-arrival, the camera's delay (default: as it was recorded)
    save
        write what was found into the recordings
    """

    recordings: Annotated[tuple[Path, ...], ARGUMENTS]
    within: Annotated[float, RADAR_SEARCH_S] | None = None
    by_arrival: bool = False
    camera_delay_ms: float | None = None
    save: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.camera_delay_ms is not None and not self.by_arrival:
            raise OptionError("--camera-delay-ms is given without --by-arrival", "both")


@command("align", Align)
def _align(options: Align) -> int:
    """Find the time offset of video and radar from what both saw.

    Compares mean velocity and motion of the mesh's synthetic map with those of the
    radar's map at every offset. Where none stands out, as the motion repeats itself or
    the two do not belong together, the recording stays as it is, the reason is printed,
    and the exit code is 1.

      sd2 align walk.sd2
      sd2 align anna.sd2 ben.sd2 --save
      sd2 align walk.sd2 --within 20 --json
      sd2 align take.sd2 --by-arrival --camera-delay-ms 45 --save
    """
    from sd2core.files.resources import is_bundled
    from sd2core.recording.recording import open_recording

    recordings = [open_recording(path) for path in options.recordings]
    for recording in recordings:
        if options.save and is_bundled(recording.folder):
            raise Sd2Error(f"{recording.folder} comes with the program", "a recording of your own")
    entries = [_aligned(recording, options) for recording in recordings]
    if options.json:
        print_json({"recordings": entries})
    else:
        for recording, entry in zip(recordings, entries, strict=True):
            print_facts(str(recording.folder), _facts(entry))
    return 1 if any(entry["problem"] for entry in entries) else 0


def _aligned(recording: Recording, options: Align) -> dict[str, Any]:
    """Entry of one recording; what cannot be aligned or saved is told in it, and others go on."""
    before_s = recording.radar_offset_s
    entry: dict[str, Any] = {
        "recording": str(recording.folder), "before_s": before_s, "saved": False
    }  # fmt: skip
    try:
        if options.by_arrival:
            return entry | _by_arrival(recording, options)
        alignment = _alignment(recording, options.within)
        if options.save and not alignment.problem:
            recording.radar_offset_s = alignment.offset_s
            recording.save()
            entry["saved"] = True
    except Sd2Error as error:
        return entry | {"problem": str(error)}
    return entry | {
        "problem": alignment.problem,
        "offset_s": alignment.offset_s,
        "confidence": alignment.confidence,
        "correlation": alignment.peak,
        "curve": {
            "offset_s": alignment.offsets_s.round(3).tolist(),
            "correlation": alignment.correlation.round(4).tolist(),
        },
    }


def _by_arrival(recording: Recording, options: Align) -> dict[str, Any]:
    """Find the offset by the arrivals that were kept, and save it if that is wanted."""
    from sd2core.live.clocks import Clocks, arrival_line, link_clocks

    clocks = Clocks.read(recording.folder)
    if clocks is None or recording.radar is None:
        raise Sd2Error(
            f"{recording.folder} does not say when its frames arrived",
            "a recording of `sd2 record`",
            "Align it by what both saw, without --by-arrival",
        )
    if options.camera_delay_ms is not None:
        clocks = replace(clocks, video_delay_s=1e-3 * options.camera_delay_ms)
    line = link_clocks(recording, clocks) if options.save else arrival_line(recording.radar)
    return {
        "problem": "",
        "offset_s": clocks.offset_s(line),
        "jitter_s": line.jitter_s,
        "saved": options.save,
    }


def _alignment(recording: Recording, within_s: float | None) -> Alignment:
    from sd2core.cli.recording_maps import maps_of
    from sd2core.doppler.alignment import WITHIN_S, align

    maps, offset_s = maps_of(recording, ("synthetic", "radar")), recording.radar_offset_s
    return align(
        maps["synthetic"],
        maps["radar"].shifted(-offset_s),
        around_s=offset_s,
        within_s=within_s or WITHIN_S,
    )


def _facts(entry: dict[str, Any]) -> dict[str, str]:
    if "offset_s" not in entry:
        return {"not aligned": entry["problem"]}
    if "jitter_s" in entry:
        facts = {"arrivals": f"± {1e3 * entry['jitter_s']:.1f} ms"}
    else:
        facts = {
            "confidence": f"{entry['confidence']:.3f}",
            "correlation": f"{entry['correlation']:.2f}",
        }
    if entry["problem"]:
        return {"not aligned": entry["problem"]} | facts
    return {
        "radar offset": f"{entry['offset_s'] + 0.0:g} s (was {entry['before_s']:g} s)",
        **facts,
        "saved": "yes" if entry["saved"] else "no (--save)",
    }
