"""``sd2 record``: a camera and a radar together, into one recording on one clock."""

from __future__ import annotations

import contextlib
import math
import re
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.output import counted, print_event, print_facts, print_json
from sd2core.options.kinds import Around, Positive
from sd2core.options.records import OptionError, Place
from sd2core.options.shared import Json

if TYPE_CHECKING:
    from sd2core.cli.listen import Status
    from sd2core.live.cameras import Camera, CameraChoice
    from sd2core.live.checking import Answer
    from sd2core.live.clocks import ClockLine
    from sd2core.live.filming import Film
    from sd2core.live.joint import JointRecording, Station
    from sd2core.live.sources import Source

_CHECK_S, _FINDINGS_S = 10.0, 1.0
_SIZE = re.compile(r"(\d{2,5})x(\d{2,5})")


class Record(Json):
    """Options of ``sd2 record``.

    Parameters
    ----------
    camera : SOURCE
        a camera's number (0 is the first), the URL of a stream, a video file, which is played at
        its rate, or `test`
    radar : SOURCE
        `test` (`test:20`: with 20 frames/s); `a121`, Acconeer's sensor (`a121:PLACE`: at a serial
        port or IP address); `ti`, a board of TI's that is set up and started (`ti:PLACE`: at a
        serial port); a plug-in's, NAME[:PLACE]; a capture or recording, replayed at its own
        rate; or with --setup the address of this computer that a DCA1000 sends to, ADDRESS[:PORT]
    setup : FILE
        what the radar runs with: a .cfg or .json of TI's (with `ti` a .cfg), a session of
        Acconeer's tool with `a121`
    out : NAME.sd2|FOLDER
        the recording to write, or the folder of a session (--protocol), which goes on
    protocol : FILE|paper
        guide people through the takes of this protocol (docs/formats.md): Space goes on, a: again,
        s: skip, q: stop; y and n answer its text of consent
    check
        record nothing: say whether radar and camera see the same person move, where, with which
        sign and delay; the exit code is 1 if one of four findings is bad
    placement : RANGE,AZIMUTH[,ELEVATION]
        where the radar is as seen from the person, in metres and degrees, as --check finds it: kept
        as the recording's planned placement
    size : WIDTHxHEIGHT
        of the camera's pictures, where it can (default: as it comes)
    rate : HZ
        frames per second of the camera, where it can
    exposure : VALUE
        fixed exposure in the driver's own unit, where it can (default: the camera chooses)
    camera_delay_ms : MS
        from an exposure to the arrival of its picture, as measured (default: what is known of the
        source: 0 for a camera)
    radar_delay_ms : MS
        from the middle of a frame's chirps to its arrival (default: half of them)
    seconds : S
        stop after so long (default: never; 10 with --check)
    previews
        with --json, small pictures of the camera, and every column of the Doppler map; with --check
        what was found so far
    """

    camera: str
    radar: str
    setup: Path | None = None
    out: Annotated[Path | None, Place(one_of="purpose", needed=True)] = None
    protocol: str | None = None
    check: Annotated[bool, Place(one_of="purpose", needed=True)] = False
    placement: Around | None = None
    size: str | None = None
    rate: Positive | None = None
    exposure: float | None = None
    camera_delay_ms: float | None = None
    radar_delay_ms: float | None = None
    seconds: Positive | None = None
    previews: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.previews and not self.json:
            raise OptionError(
                "--previews is given without --json", "both, for a program that reads them"
            )
        if self.placement is not None and self.check:
            raise OptionError("--placement is given with --check", "what --check finds")
        if self.protocol is not None and (self.seconds or self.previews or self.check):
            raise OptionError(
                "--protocol is given with --seconds, --previews or --check",
                "the protocol, which says how long",
            )
        if self.size is not None and _SIZE.fullmatch(self.size) is None:
            raise OptionError(f"--size is {self.size!r}", "WIDTHxHEIGHT, as in 1280x720")


@command("record", Record)
def _record(options: Record) -> int:
    """Record a camera and a radar together, on one clock.

    Each frame of both has the time at which it arrived at this computer, less the delay
    of its source; how fast the radar's clock runs is found from all arrivals. The
    recording can be opened at any moment, aligned; `sd2 align` checks it by what both
    saw. The video is encoded in a process of its own. Ctrl-C or q stops. Without
    hardware: `test`. Before the first take, --check says what both see while somebody
    walks towards them and away again.

      sd2 record --camera 0 --radar 192.168.33.30 --setup profile.cfg --check
      sd2 record --camera test --radar test --out try.sd2 --seconds 10
      sd2 record --camera 0 --radar 192.168.33.30 --setup profile.cfg --out take.sd2
      sd2 record --camera walk.mp4 --radar walk.sd2 --out again.sd2
      sd2 record --camera test --radar test --protocol paper --out session
    """
    from sd2core.live.cameras import CameraChoice

    size = _SIZE.fullmatch(options.size) if options.size else None
    choice = CameraChoice(
        options.camera,
        (int(size[1]), int(size[2])) if size else None,
        options.rate,
        options.exposure,
    )
    if options.check:
        return _check(options, choice)
    if options.protocol is not None:
        _guide(options, choice)
    else:
        _take(options, choice)
    return 0


def _check(options: Record, choice: CameraChoice) -> int:
    """Say what radar and camera see; 1 if they cannot be recorded with."""
    from sd2core.cli.keys import pressed_keys
    from sd2core.live.checking import check_place, found_place
    from sd2core.live.filming import preview_of
    from sd2core.live.looking import Looked, look
    from sd2core.live.radars import open_radar
    from sd2core.live.reception import Reception
    from sd2core.runs.control import stop_signals

    seconds = options.seconds or _CHECK_S
    with contextlib.ExitStack() as stack, stop_signals() as stop, pressed_keys() as key:
        reception = Reception(open_radar(options.radar, options.setup))
        stack.callback(reception.close)
        source, camera = reception.source, choice.open()
        stack.callback(camera.close)
        if not options.json:
            print(f"{camera.about}\n{source.about}\n  {seconds:g} s: walk towards both, and away.")
        radar, begin_s = source.head(0.0).radar, time.monotonic()
        shown: Any = None
        printed = 0

        def follow(looked: Looked) -> None:
            nonlocal shown, printed
            if key().lower() == "q":
                stop.set()
            if not options.previews:
                return
            if looked.picture is not None and looked.picture is not shown:
                shown = looked.picture
                print_event("preview", picture=preview_of(looked.picture))
            passed_s = time.monotonic() - begin_s
            if passed_s >= (printed + 1) * _FINDINGS_S:
                printed += 1
                left_s = max(math.ceil(seconds - passed_s), 1)
                findings = check_place(radar, looked.seen, looked.moved)
                print_event("findings", left_s=left_s, **_data(findings))

        delays_s = _delays_s(options, camera, source)
        looked = look(reception, camera, delays_s, seconds, stop, follow)
    findings = check_place(radar, looked.seen, looked.moved)
    if options.previews:
        print_event("findings", left_s=0, **_data(findings))
    elif options.json:
        print_json(_data(findings))
    else:
        for one in findings:
            print(f"  {'ok   ' if one.passed else 'WRONG'}  {one.sentence}")
        if (place := found_place(findings)) is not None:
            print(f"  As seen from what moves, a radar beside the camera is at {place.words}.")
            print(f"  To keep that in recordings: --placement {place.range_m},{place.azimuth_deg}")
    return 0 if all(one.passed for one in findings) else 1


def _data(findings: list[Answer]) -> dict[str, Any]:
    """Findings, and the place that follows from them, for other programs."""
    from sd2core.live.checking import found_place

    place = found_place(findings)
    data = {"findings": [vars(one) for one in findings]}
    return data | {"place": None if place is None else vars(place)}


def _guide(options: Record, choice: CameraChoice) -> None:
    from sd2core.cli.guiding import guide
    from sd2core.live.protocol import read_protocol

    assert options.out is not None
    protocol = read_protocol(options.protocol or "")
    with _station(options, choice) as station:
        guide(protocol, options.out, station.begin, as_json=options.json)


def _take(options: Record, choice: CameraChoice) -> None:
    from sd2core.cli.listen import Status, follow

    assert options.out is not None
    with _station(options, choice) as station, station.begin(options.out) as take:
        listening = take.listening
        status = Status(listening, take.source, as_json=options.json, columns=options.previews)
        status.more, status.each_time = take.progress, partial(_follow, take, status)
        status.nothing = "No frame of the radar came: the recording holds the video alone."
        status.begin(take.folder, False, take.about)
        follow(listening, status, options.seconds, take.stop)
        status.end(take.folder)
        if (line := take.correct_clocks()) is not None:
            _print_clocks(take, line, as_json=options.json)


def _follow(take: JointRecording, status: Status) -> None:
    """Link what is recorded as soon as it can be, and tell the newest picture."""
    take.follow()
    if take.film.is_over:
        status.warn_once("The camera has ended: the radar is recorded alone from here on.")
    if (preview := take.film.next_preview()) is not None:
        print_event("preview", picture=preview, **take.progress())


def _station(options: Record, choice: CameraChoice) -> Station:
    """Camera and radar that the options name."""
    from sd2core.live.joint import Station
    from sd2core.live.radars import open_radar
    from sd2core.placements.placements import PlacementGrid

    place = options.placement
    return Station(
        choice,
        partial(open_radar, options.radar, options.setup),
        partial(_delays_s, options),
        placements=None if place is None else PlacementGrid(*((number,) for number in place)),
        previews=options.previews,
    )


def _delays_s(options: Record, camera: Camera | Film, source: Source) -> tuple[float, float]:
    """Delays of camera and radar, as given or as known of them."""
    given_ms = options.camera_delay_ms, options.radar_delay_ms
    return (
        camera.delay_s if given_ms[0] is None else 1e-3 * given_ms[0],
        source.delay_s if given_ms[1] is None else 1e-3 * given_ms[1],
    )


def _print_clocks(take: JointRecording, line: ClockLine, *, as_json: bool) -> None:
    """Say what the clocks of camera and radar are."""
    filmed = take.film.filmed
    if as_json:
        print_event(
            "clocks",
            pictures=filmed.recorded,
            pictures_dropped=filmed.dropped,
            drift_ppm=line.drift_ppm,
            jitter_s=line.jitter_s,
        )
        return
    dropped = f", {filmed.dropped:,} dropped" if filmed.dropped else ""
    print_facts(
        "clocks",
        {
            "pictures": f"{counted(filmed.recorded, 'frame')}{dropped}",
            "radar": f"slow by {line.drift_ppm:+.1f} millionths, arrivals ± "
            f"{1e3 * line.jitter_s:.1f} ms",
            "delays": "camera {:g} ms, radar {:.1f} ms".format(
                *(1e3 * delay_s for delay_s in take.delays_s)
            ),
        },
    )
