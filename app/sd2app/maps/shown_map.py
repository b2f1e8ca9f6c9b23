"""The synthetic map as far as it is painted, on its track."""

from __future__ import annotations

from sd2app.maps.partial_map import AS_DRAGGED, FINAL, Canvas, View
from sd2app.maps.refine import Part
from sd2app.session.content import reference_of
from sd2app.session.tracks import TrackModel
from sd2core.doppler.options import SynthesisOptions
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence


class PaintedMap:
    """Takes stretches over, and says on the track what they are worth."""

    def __init__(self, track: TrackModel) -> None:
        self._track = track
        self.forget()

    def forget(self) -> None:
        """There is no mesh."""
        self.canvas = Canvas.blank(2, 0)
        self._scene: tuple[SynthesisOptions, MeshSequence] | None = None
        self._words: dict[int, str] = {}
        self._needs_reference = True

    def begin(self, options: SynthesisOptions, mesh: MeshSequence) -> None:
        """Nothing of this mesh is known yet."""
        self.forget()
        self._scene = options, mesh
        self.canvas = Canvas.blank(options.axis.bins, mesh.frame_count)

    def demote(self) -> None:
        """What was final no longer is, but stays until it is replaced."""
        self.canvas.demote()
        self._words[AS_DRAGGED] = self._words.get(FINAL, self._words.get(AS_DRAGGED, ""))

    def take(self, part: Part) -> None:
        """Paint a stretch; the first whole map says what 0 dB is."""
        assert self._scene is not None
        options, mesh = self._scene
        self.canvas.paint(part.sensor, part.start, part.stretch, part.rank)
        self._words[part.rank] = part.words
        if self._needs_reference and self.canvas.full:
            self._needs_reference = False
            self._track.set_reference(reference_of(self.canvas.values))
        painted = DopplerMap(
            values=self.canvas.values,
            axis=options.axis,
            timebase=mesh.timebase,
            kind="synthetic",
            unit=part.unit,
            null_bins=options.null_bins,
            present=mesh.presence.measured,
        )
        self._track.set_map(painted, None if self.canvas.full else self.canvas.rank > 0)

    def say_quality(self, view: View, final_words: str, compiling: bool) -> None:
        """Write the lowest quality in view on the track."""
        start, stop = view
        rank = self.canvas.rank[start:stop]
        if not rank.any():
            return
        final = float((rank >= FINAL).mean())
        lowest = int(rank[rank > 0].min())
        words = final_words if lowest == FINAL else self._words.get(lowest, "")
        if 0 < final < 1 and lowest < FINAL:
            words = f"{words}, {100 * final:.0f} % final"
        if compiling:
            words += " · compiling, exact follows"
        self._track.set_status(words)
