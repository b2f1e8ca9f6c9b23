"""Export of cut-outs into a folder, in the background."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner
from sd2app.session.document import DocumentModel
from sd2app.session.maps import MapModel
from sd2app.session.tasks import Job, TaskList
from sd2core.cutouts.cutting import Cut, cut_out, plan_cuts
from sd2core.cutouts.source import CutSource, Part
from sd2core.labels.spans import Labels, Span


class _Plan(NamedTuple):
    source: CutSource
    cuts: list[Cut]
    folder: Path

    @property
    def others(self) -> int:
        """Folders that hold something else."""
        return sum(one.state == "other" for one in self.cuts)


class _Done(NamedTuple):
    folder: Path
    written: int
    same: int


class CutOutModel(QObject):
    """Cuts spans out into folders; asks first where a folder holds something else.

    ``maps`` are named by their files.
    """

    asked = Signal(int, str)  # number of occupied folders, one of them; answer: go_on or give_up
    noted = Signal(str)
    failed = Signal(str)

    def __init__(
        self,
        document: DocumentModel,
        maps: dict[str, MapModel],
        jobs: TaskList,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._document, self._maps, self._jobs = document, maps, jobs
        self._plan: _Plan | None = None
        self._job: Job | None = None
        self._runner = LatestRunner("cut", self)
        self._runner.partial.connect(self._report)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._fail)

    @property
    def busy(self) -> bool:
        """True while exporting."""
        return self._runner.busy

    def source(self, parts: Iterable[Part] = ("video", "mesh", "maps")) -> CutSource | None:
        """Return the parts of the recording, without maps that are still computed."""
        content = self._document.content
        if content is None:
            return None
        maps = {
            name: track.map.shifted(track.offset_s)
            for name, track in self._maps.items()
            if track.map is not None and track.covered is None
        }
        recording = content.recording
        whole = CutSource(
            recording.title,
            recording.simulated,
            content.timebase,
            recording.video if content.video is not None else None,
            content.mesh,
            maps,
            recording.sensor.position_m,
        )
        return whole.only(parts)

    def start(self, spans: Sequence[Span], parts: Iterable[Part], folder: Path) -> None:
        """Compare with the folder, then export."""
        source = self.source(parts)
        if source is None:
            return
        self._begin(f"Cutting out {len(spans)} span{'s' * (len(spans) != 1)}")
        self._runner.submit(lambda emit: _Plan(source, plan_cuts(source, spans, folder), folder))

    def go_on(self, *, replace_others: bool) -> None:
        """Export; folders that hold something else are replaced or kept."""
        plan, self._plan = self._plan, None
        if plan is None:
            return

        def cut(emit: Emit) -> _Done:
            written = cut_out(
                plan.source,
                plan.cuts,
                plan.folder,
                replace_others=replace_others,
                progress=lambda done, total: emit((done, total)),
            )
            return _Done(plan.folder, len(written), len(plan.cuts) - len(written))

        self._runner.submit(cut)

    def give_up(self) -> None:
        """Stop; complete folders stay, and the next export continues from there."""
        self._runner.cancel()
        self._plan = None
        self._end()

    def close(self) -> None:
        """Stop, and wait until nothing is being written."""
        self._runner.close()
        self._end()

    # --- inside ---------------------------------------------------------------------------

    def _begin(self, title: str) -> None:
        self._end()
        self._job = self._jobs.start(title, self.give_up)

    def _end(self) -> None:
        if self._job is not None:
            self._jobs.finish(self._job)
            self._job = None

    def _report(self, progress: Any) -> None:
        if self._job is not None:
            self._jobs.report(self._job, *progress)

    def _receive(self, result: _Plan | _Done) -> None:
        if isinstance(result, _Plan):
            self._plan = result
            if result.others:
                one = next(cut for cut in result.cuts if cut.state == "other")
                self.asked.emit(result.others, one.path.name)
            else:
                self.go_on(replace_others=False)
            return
        self._end()
        count, same = result.written, result.same
        words = f"{count} span{'s' * (count != 1)} cut out into {result.folder}."
        self.noted.emit(f"{words} {same} stayed as they were." if same else words)

    def _fail(self, error: Exception) -> None:
        self._end()
        self.failed.emit(str(error))


def groups(labels: Labels, selected: Sequence[Span]) -> list[tuple[str, tuple[Span, ...]]]:
    """Return choices of spans: the selection, all, or the spans of one label."""
    decided = [span for span in labels.spans if span.origin != "suggestion"]
    chosen = tuple(span for span in selected if span.origin != "suggestion")
    found = [("the selected", chosen)] if chosen else []
    found.append(("all", tuple(decided)))
    by_label: dict[str, list[Span]] = {
        name: [] for name in dict.fromkeys(span.label for span in decided)
    }
    for span in decided:
        by_label[span.label].append(span)
    return found + [(name, tuple(spans)) for name, spans in by_label.items()]
