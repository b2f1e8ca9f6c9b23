"""Guided sessions on the command line: what is to be done is printed, keys steer it."""

from __future__ import annotations

import contextlib
import math
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from sd2core.cli import keys
from sd2core.cli.output import counted, print_event, print_rows, tell
from sd2core.errors import Sd2Error
from sd2core.files.atomic import replace_folder
from sd2core.files.lock import FileLock
from sd2core.files.paths import remove
from sd2core.files.tables import capitalised
from sd2core.labels.spans import Span
from sd2core.live.consent import Consent
from sd2core.live.joint import JointRecording
from sd2core.live.prompting import label_take
from sd2core.live.protocol import Protocol, Take
from sd2core.live.session import Session
from sd2core.live.videos import hide_person
from sd2core.recording.recording import FILE_NAME, SUFFIX, is_recording, open_recording
from sd2core.runs.control import stop_signals

UNFINISHED = "unfinished"
"""Folder for the take that is being made."""

_LOCK = ".session.lock"
_LETTERS = 80
"""In a line of the text that is agreed to."""
_WAIT_S = 0.05
_OPEN_S = 15.0
"""By then, camera and radar have given something."""


def guide(
    protocol: Protocol, folder: Path, open_take: Callable[[Path], JointRecording], *, as_json: bool
) -> None:
    """Record the takes of a protocol that are not in a folder yet, and say what is missing.

    Parameters
    ----------
    protocol : Protocol
    folder : Path
        Is made where only its parent exists.
    open_take : callable
        Begins to record camera and radar into a folder.
    as_json : bool
        True if events are printed, for other programs.
    """
    if not folder.parent.is_dir():
        raise Sd2Error(f"The folder {folder.parent} does not exist", "an existing folder")
    if (folder / FILE_NAME).exists():
        raise Sd2Error(
            f"{folder} is a recording", "a folder for the takes of a session", "Give another --out"
        )
    folder.mkdir(exist_ok=True)
    lock = FileLock(folder / _LOCK)
    if not lock.take():  # two would write over each other's takes, and what people agreed to
        raise Sd2Error(
            f"A session goes on in {folder} already", "one at a time in a folder", "End that first"
        )
    with contextlib.ExitStack() as stack:
        stack.callback(lock.release, delete=True)
        done = [path.stem for path in folder.glob(f"*{SUFFIX}") if is_recording(path)]
        consent = Consent(folder, protocol.consent_text)
        session = Session(protocol, done, consent.agreements)
        telling = _Telling(session, consent, as_json=as_json)
        telling.begin(folder)
        if protocol.video != "keep":
            takes = [folder / f"{take.name}{SUFFIX}" for take in session.takes if take.name in done]
            telling.hidden(
                protocol.video, [one.stem for one in takes if _hides(one, protocol.video)]
            )
        with (
            stop_signals() as stop,
            keys.pressed_keys() as key,
            contextlib.closing(_Takes(session, folder, open_take, telling)) as recorder,
        ):
            while session.phase != "over" and not stop.is_set() and _press(session, consent, key()):
                recorder.leave()
                session.advance(time.monotonic())
                telling.step()
                recorder.follow()
        telling.end()


def _hides(take: Path, how: Literal["blur", "drop"]) -> bool:
    """Hide the person of a take that has a body; False where there is none, or that was done."""
    recording = open_recording(take)
    if recording.mesh is None or "mesh" in recording.missing():
        return False
    try:
        return hide_person(take, how)
    except Sd2Error as error:  # of one take: the others go on
        print(f"sd2: {take.name}: {error}", file=sys.stderr, flush=True)
        return False


def _press(session: Session, consent: Consent, key: str) -> bool:
    """Take a key; False for the one that stops."""
    match key.lower():
        case " " | "\n" | "\r":
            session.go_on()
        case "y" if session.phase == "consent" and session.take is not None:
            consent.agree(session.take.person)  # first: nobody is recorded without it
            session.agree()
        case "n":
            session.decline(time.monotonic())
        case "a":
            session.again(time.monotonic())
        case "s":
            session.skip(time.monotonic())
        case "q":
            return False
        case keys.NO_MORE if session.phase in ("consent", "ready"):
            raise Sd2Error(
                "A session waits for a key, and nobody can press one: the input has ended",
                "a terminal, or a program that presses keys",
                "Run it in a terminal, in the foreground",
            )
    return True


class _Takes:
    """The take that is being recorded, and where it goes."""

    def __init__(
        self,
        session: Session,
        folder: Path,
        open_take: Callable[[Path], JointRecording],
        telling: _Telling,
    ) -> None:
        self._session, self._folder, self._open_take = session, folder, open_take
        self._telling = telling
        self._recording: JointRecording | None = None
        self._silent_after_s = math.inf

    def leave(self) -> None:
        """Give up what is recorded where a key said so."""
        if self._recording is not None and not self._session.records:
            recording, self._recording = self._recording, None
            with recording:
                recording.stop()
            remove(recording.folder)

    def follow(self) -> None:
        """Record what the session wants to be recorded; else wait a moment."""
        session, recording = self._session, self._recording
        if not session.records:
            time.sleep(_WAIT_S)
            return
        if recording is None:
            recording = self._recording = self._begin()
        recording.listening.next_column(_WAIT_S)
        recording.follow()
        if session.phase == "opening" and recording.linked:
            session.opened(time.monotonic())
        elif session.phase == "opening" and time.monotonic() > self._silent_after_s:
            why = recording.source.silence() or "A camera or a radar gives nothing"
            raise Sd2Error(f"{why} ({_OPEN_S:g} s)", "pictures and frames")
        elif session.phase == "storing":
            self._store(recording)
            session.stored(time.monotonic())
        elif recording.listening.is_over or recording.film.is_over:
            raise Sd2Error(
                "The camera or the radar has ended within a take",
                f"{session.protocol.countdown_s + session.protocol.take_s:g} s of both",
            )

    def close(self) -> None:
        """Give up the take that is not finished, where the session ends."""
        if self._recording is not None:
            with self._recording:
                self._recording.stop()
            remove(self._recording.folder)
        with contextlib.suppress(OSError):
            (self._folder / UNFINISHED).rmdir()

    def _begin(self) -> JointRecording:
        assert self._session.take is not None
        unfinished = self._folder / UNFINISHED
        unfinished.mkdir(exist_ok=True)
        folder = unfinished / f"{self._session.take.name}{SUFFIX}"
        remove(folder)  # left by a session that was killed
        recording = self._open_take(folder)
        recording.listening.start()
        self._silent_after_s = time.monotonic() + _OPEN_S
        return recording

    def _store(self, recording: JointRecording) -> None:
        session, end_s = self._session, time.monotonic()
        assert session.take is not None
        with recording:
            recording.stop()
        self._recording = None
        recording.correct_clocks()
        span = label_take(recording.folder, session.protocol, session.take, session.prompt_s, end_s)
        place = self._folder / recording.folder.name
        before = recording.folder.with_suffix(".before")
        replace_folder(recording.folder, place, before)
        remove(before)  # where it was made again
        self._telling.stored(session.take, span, _losses(recording))


def _losses(recording: JointRecording) -> list[str]:
    """Sentences on losses and faults."""
    losses = recording.listening.doubts(at_end=True)
    if missing := recording.listening.counts.missing:
        losses.append(f"Of the radar: {missing}.")
    if dropped := recording.film.filmed.dropped:
        losses.append(f"Of the camera: {counted(dropped, 'picture')} dropped.")
    return losses


class _Telling:
    """Printer of the session's events."""

    def __init__(self, session: Session, consent: Consent, *, as_json: bool) -> None:
        self._session, self._consent, self._as_json = session, consent, as_json
        self._state: tuple[Any, ...] = ()

    def begin(self, folder: Path) -> None:
        """Say what is to be recorded, and the keys."""
        session, protocol = self._session, self._session.protocol
        missing = len(session.missing)
        if self._as_json:
            print_event(
                "session",
                title=protocol.title,
                out=str(folder),
                takes=len(session.takes),
                missing=missing,
                consent=protocol.consent_text,
            )
            return
        print(f"{protocol.title}: {missing:,} of {counted(len(session.takes), 'take')} to record")
        tell(f"  into {folder}. Space or Enter: go on, a: again, s: skip, q: stop.")

    def hidden(self, how: Literal["blur", "drop"], names: list[str]) -> None:
        """Say in whose videos the head was covered, or whose were deleted."""
        if self._as_json:
            print_event("dropped" if how == "drop" else "blurred", takes=names)
        elif names:
            done = "The video was deleted" if how == "drop" else "The head was covered in the video"
            tell(f"{done}, since there is a body: {', '.join(names)}")

    def step(self) -> None:
        """Say what is to be done, where that has changed or another second has passed."""
        session, left_s = self._session, self._session.left_s(time.monotonic())
        left = None if left_s is None else math.ceil(left_s)
        state = (session.phase, session.take, left)
        if state == self._state:
            return
        is_new, self._state = state[:2] != self._state[:2], state
        take = session.take
        if self._as_json:
            asked = None if take is None else session.protocol.gesture(take.gesture)
            print_event(
                "step",
                phase=session.phase,
                number=session.number,
                takes=len(session.takes),
                left_s=left,
                **({} if take is None else take._asdict()),
                instruction="" if asked is None else asked.instruction,
            )
        elif is_new:
            for line in self._lines(take):
                tell(line)
        elif session.phase == "countdown":
            tell(f"  {left}")

    def _lines(self, take: Take | None) -> list[str]:
        """Lines that announce a new phase."""
        session, protocol = self._session, self._session.protocol
        if take is None:
            return ["That was the last take. a: again."] if session.phase == "pause" else []
        doing = f"{session.number} of {len(session.takes)}, {take.person}: "
        doing += protocol.gesture(take.gesture).instruction
        match session.phase:
            case "consent":
                asks = f"{take.person}: do you agree? y: yes, n: no (none of your takes is made)."
                paragraphs = protocol.consent_text.splitlines()
                return ["", *(textwrap.fill(one, _LETTERS) for one in paragraphs), asks]
            case "ready":
                return ["", f"{take.person}: Space begins."]
            case "pause":
                return ["", f"Next, in {protocol.pause_s:g} s: {doing}"]
            case "opening":
                return ["", f"{doing}. Stand still…"]
            case "countdown":
                return [f"  {math.ceil(protocol.countdown_s)}"]
            case "prompt":
                return [f"  NOW, for {protocol.take_s:g} s"]
        return []

    def stored(self, take: Take, span: Span, losses: list[str]) -> None:
        """Say what a take has become."""
        if self._as_json:
            print_event(
                "stored",
                take=take.name,
                start_s=span.start_s,
                end_s=span.end_s,
                motion=not span.note,
                doubts=losses,
            )
            return
        motion = span.note or "motion"
        tell(f"  {take.name}: {motion} from {span.start_s:.2f} to {span.end_s:.2f} s")
        for loss in losses:
            print(f"sd2: {take.name}: {loss}", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Say what is missing."""
        missing, agreed = self._session.missing, self._consent.agreements
        asks = bool(self._session.protocol.consent_text)
        if self._as_json:
            without = {take.person: None for take in missing if asks and take.person not in agreed}
            print_event("missing", takes=[take.name for take in missing], not_agreed=[*without])
        elif missing:
            rounds: dict[tuple[str, str], list[str]] = {}
            for take in missing:
                rounds.setdefault((take.person, take.gesture), []).append(str(take.repetition))
            print(f"\n{capitalised(counted(len(missing), 'take'))} missing:")
            rows = [("person", "gesture", "round", "agreed")]
            for (person, gesture), numbers in rounds.items():
                when = (
                    f"{agreed[person].agreed_at:%Y-%m-%d %H:%M} UTC" if person in agreed else "no"
                )
                rows.append((person, gesture, ", ".join(numbers), when))
            print_rows(rows if asks else [row[:-1] for row in rows])
        else:
            print("\nNothing is missing.")
