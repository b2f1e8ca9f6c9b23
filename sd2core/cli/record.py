"""``sd2 record``: a camera and a radar together, into one recording on one clock."""

from __future__ import annotations

import argparse
import contextlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import counted, print_event, print_facts, print_json
from sd2core.errors import Sd2Error
from sd2core.options.kinds import Positive
from sd2core.options.records import OptionError, Place
from sd2core.options.shared import Json
from sd2core.runs.control import stop_signals

if TYPE_CHECKING:
    from sd2core.live.cameras import Camera
    from sd2core.live.clocks import ClockLine
    from sd2core.live.filming import CameraChoice, Film
    from sd2core.live.listening import Listening
    from sd2core.live.recording import GrowingRecording
    from sd2core.live.sources import Source

_CHECK_S = 10.0
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
        port or IP address); a plug-in's, NAME[:PLACE]; a capture or recording, replayed at its own
        rate; or with --setup the address of this computer that a DCA1000 sends to, ADDRESS[:PORT]
    setup : FILE
        what the radar runs with: a .cfg or .json of TI's, a session of Acconeer's tool with `a121`
    out : NAME.sd2
        the recording to write
    check
        record nothing: say whether radar and camera see the same person move, where, with which
        sign and delay; the exit code is 1 if one of four findings is bad
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
        with --json, small pictures of the camera, and every column of the Doppler map
    """

    camera: str
    radar: str
    setup: Path | None = None
    out: Annotated[Path | None, Place(one_of="purpose", needed=True)] = None
    check: Annotated[bool, Place(one_of="purpose", needed=True)] = False
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
        if self.size is not None and _SIZE.fullmatch(self.size) is None:
            raise OptionError(f"--size is {self.size!r}", "WIDTHxHEIGHT, as in 1280x720")


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``record``."""
    add_command(commands, "record", options=Record, handler=_record)


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
    """
    from sd2core.live.filming import CameraChoice

    size = _SIZE.fullmatch(options.size) if options.size else None
    choice = CameraChoice(
        options.camera,
        (int(size[1]), int(size[2])) if size else None,
        options.rate,
        options.exposure,
    )
    if options.check:
        return _check(options, choice)
    _take(options, choice)
    return 0


def _check(options: Record, choice: CameraChoice) -> int:
    """Say what radar and camera see; 1 if they cannot be recorded with."""
    from sd2core.live.checking import check_place
    from sd2core.live.looking import look
    from sd2core.live.radars import open_radar

    seconds = options.seconds or _CHECK_S
    with contextlib.ExitStack() as stack, stop_signals() as told:
        source = open_radar(options.radar, options.setup)
        stack.callback(source.close)
        camera = choice.open()
        stack.callback(camera.close)
        if not options.json:
            print(f"{camera.about}\n{source.about}\n  {seconds:g} s: walk towards both, and away.")
        delays_s = _delays_s(options, camera, source)
        seen, moved = look(source, camera, delays_s, seconds, told)
        findings = check_place(source.head(0.0).radar, seen, moved)
    if options.json:
        print_json({"findings": [vars(one) for one in findings]})
    else:
        for one in findings:
            print(f"  {'ok   ' if one.passed else 'WRONG'}  {one.sentence}")
    return 0 if all(one.passed for one in findings) else 1


def _take(options: Record, choice: CameraChoice) -> None:
    from sd2core.cli.listen import Status, follow
    from sd2core.live.filming import VIDEO_NAME, Film
    from sd2core.live.listening import Listening
    from sd2core.live.radars import open_radar
    from sd2core.live.recording import GrowingRecording

    assert options.out is not None
    with contextlib.ExitStack() as stack:
        source = open_radar(options.radar, options.setup)
        stack.callback(source.close)
        recording = GrowingRecording(options.out, keep_arrivals=True)
        if recording.folder.exists():
            raise Sd2Error(f"{recording.folder} exists", "a new folder", "Give another as --out")
        stack.callback(recording.close)
        listening = Listening(source, recording)
        recording.folder.mkdir()
        stack.callback(_remove_empty, recording.folder)
        film = Film(choice, recording.folder / VIDEO_NAME, previews=options.previews)
        stack.callback(film.stop)
        take = _Take(options, source, recording, listening, film)
        status = Status(listening, source, as_json=options.json, columns=options.previews)
        status.more, status.each_time = take.progress, take.follow
        status.begin(recording.folder, False, f"{film.about}\n{source.about}")
        # To be told to end is to be told to stop: what waits to be stored is stored.
        with stop_signals() as told:
            listening.start()
            try:
                follow(listening, status, options.seconds, told)
            finally:
                film.stop()
                listening.stop()
        status.end(recording.folder)
        take.end()


def _delays_s(options: Record, camera: Camera | Film, source: Source) -> tuple[float, float]:
    """Delays of camera and radar, as given or as known of them."""
    given_ms = options.camera_delay_ms, options.radar_delay_ms
    return (
        camera.delay_s if given_ms[0] is None else 1e-3 * given_ms[0],
        source.delay_s if given_ms[1] is None else 1e-3 * given_ms[1],
    )


def _remove_empty(folder: Path) -> None:
    """Remove the folder of a recording that did not begin."""
    with contextlib.suppress(OSError):
        folder.rmdir()


class _Take:
    """Video and radar of a recording, linked as soon as both are there."""

    def __init__(
        self,
        options: Record,
        source: Source,
        recording: GrowingRecording,
        listening: Listening,
        film: Film,
    ) -> None:
        self._json = options.json
        self._recording, self._listening, self._film = recording, listening, film
        self._delays_s = _delays_s(options, film, source)
        self._linked = False

    def follow(self) -> None:
        """Tell the newest picture; the first time there is something of both, link them."""
        self._film.check()
        filmed = self._film.filmed
        if not self._linked and filmed.first_s is not None and self._recording.frames:
            self._link()
            self._linked = True
        if (preview := self._film.next_preview()) is not None:
            print_event("preview", picture=preview, **self.progress())

    def progress(self) -> dict[str, Any]:
        """Numbers of pictures, and whether the recording names its video."""
        filmed = self._film.filmed
        told: dict[str, Any] = {
            "pictures": filmed.recorded, "pictures_dropped": filmed.dropped, "linked": self._linked
        }  # fmt: skip
        return told

    def end(self) -> None:
        """Correct the clocks by all that arrived, and say what they are."""
        from sd2core.live.clocks import correct_drift

        filmed = self._film.filmed
        if not (filmed.recorded and self._listening.counts.recorded):
            return
        line = self._link()
        correct_drift(self._recording.radar, line)
        if self._json:
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
                "radar": f"runs {line.drift_ppm:+.1f} millionths slow, arrivals ± "
                f"{1e3 * line.jitter_s:.1f} ms",
                "delays": "camera {:g} ms, radar {:.1f} ms".format(
                    *(1e3 * delay_s for delay_s in self._delays_s)
                ),
            },
        )

    def _link(self) -> ClockLine:
        from sd2core.live.clocks import Clocks, link_clocks
        from sd2core.live.filming import VIDEO_NAME
        from sd2core.recording.recording import open_recording

        first_s = self._film.filmed.first_s
        assert first_s is not None
        recording = open_recording(self._recording.folder)
        recording.video = self._recording.folder / VIDEO_NAME
        recording.simulated = recording.simulated or self._film.simulated
        return link_clocks(recording, Clocks(first_s, *self._delays_s))
