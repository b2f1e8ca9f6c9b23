"""Draw the ways through the house: `python -m tools.documentation.journeys`.

Writes docs/images/house/NAME.svg for docs/architecture.md. Every station is a function that is
there, under its file; its column says whose hands the thing is in. The background is white, so
that drawings read alike on light and dark pages.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sd2core.files.figure_files import save_figure
from tools.documentation.measured import IMAGES, REPOSITORY

HOUSE = IMAGES / "house"
MAX_STATIONS = 12
_INK, _GREY = "#222222", "#767676"
_FACES = ("#e3ecf7", "#fdeccd", "#e6f2e4", "#f3e4e1")
_WIDTH_IN, _ROW_IN, _BOX_IN = 9.6, 0.66, (2.3, 0.46)


@dataclass(frozen=True)
class Station:
    """A function by its file, the column it stands in, and what it does to the thing."""

    column: int
    file: str  # from app/ or the root of the repository on
    function: str
    words: str
    later: bool = False  # not called by the one before, but when the user asks for it

    def resolve(self) -> object:
        """The function itself; AttributeError or ModuleNotFoundError if there is none."""
        module = import_module(self.file.removesuffix(".py").replace("/", "."))
        return attrgetter(self.function)(module)


@dataclass(frozen=True)
class Journey:
    """Stations in the order in which they are called, and the names of their columns."""

    columns: tuple[str, ...]
    stations: tuple[Station, ...]

    @classmethod
    def read(cls, text: str) -> Journey:
        """A journey from the names of its columns and a line per station."""
        columns, *lines = text.strip().splitlines()
        stations = []
        for line in lines:
            column, file, rest = line.removeprefix("- ").split(" ", 2)
            function, words = rest.split(": ", 1)
            stations.append(Station(int(column), file, function, words, line.startswith("- ")))
        return cls(tuple(columns.split(", ")), tuple(stations))


# A line per station: column, file, function, and what it does; a dash before those that are not
# called by the one before, but when the user asks for it.
JOURNEYS = {
    name: Journey.read(text)
    for name, text in {
        "array": """
video, body, mesh, map
0 sd2core/io/video.py VideoReader.read: a picture, (height, width, 3)
1 sd2core/body/person_tracker.py PersonTracker.step: where the person is
1 sd2core/body/refining.py Refiner.stretch: landmarks, (T, 33, 2)
1 sd2core/body/landmark_repair.py repair_landmarks: sides, spikes, gaps put right
1 sd2core/body/lifter.py Lifter.lift: depth of each landmark
1 sd2core/body/solve.py solve: angles of the joints, by Gauss–Newton
2 sd2core/body/fitted.py FittedMotion.mesh: vertices, (T, V, 3)
2 sd2core/io/mesh.py save_mesh: a file, which load_mesh reads
3 sd2core/doppler/prepared.py PreparedMesh.counted: moving vertices of a block
3 sd2core/doppler/masks.py VisibilityMasks.for_rows: which the sensor sees
3 sd2core/doppler/histogram.py count: velocities counted in bins
3 sd2core/doppler/smoothing.py smooth: DopplerMap.values, (bins, T)
""",
        "label": """
window, models, library, disk
0 sd2app/labels/actions.py LabelActions: the action that has the key
0 sd2app/labels/feature.py LabelsFeature._use_label: mark, or relabel?
1 sd2app/labels/edits.py LabelMarking.mark: begins; pressed again, ends
1 sd2app/labels/edits.py LabelEdits.apply: refused where read-only
2 sd2core/labels/edits.py Edits.create: old labels to new ones, pure
1 sd2app/session/undo.py Edits.set_labels: a step of the undo history
1 sd2app/labels/autosave.py LabelAutosave._follow_history: before it is shown
3 sd2core/labels/journal.py Journal.write: a record, flushed to disk
1 sd2app/labels/model.py LabelsModel.set_labels: changed: all views redraw
- 0 sd2app/shell/files.py FilesFeature.save: Ctrl+S
2 sd2core/recording/recording.py Recording.save: unless changed by others
3 sd2core/labels/files.py write_labels: the file of labels, replaced
""",
        "drag": """
views, models, background thread, library
0 sd2app/scene/view.py SceneView.eventFilter: the pointer moves
0 sd2app/scene/navigation.py Navigator.move: pixels to metres
1 sd2app/session/undo.py Edits.drag_sensor: one step in the end
1 sd2app/session/sensor.py SensorModel.set_sensor: changed
1 sd2app/maps/model.py SynthesisModel._follow: asks for a sweep
1 sd2app/maps/model.py SynthesisModel._preview: as exact as time allows
1 sd2app/background/latest.py LatestRunner.submit: the newest wins
2 sd2app/maps/quality.py SynthesizerCache.part: frames of a map
3 sd2core/doppler/synthesizer.py Synthesizer.stretch: as in the first picture
1 sd2app/maps/partial_map.py PartialMap.take: back in the window's thread
1 sd2app/session/maps.py MapModel.set_map: changed
0 sd2app/maps/heatmap.py HeatmapView.paint: pixels
""",
        "training": """
command, data, network, disk
0 sd2core/cli/train.py _train: options to settings
3 sd2core/train/start.py begin: a locked folder, config.toml
0 sd2core/train/run.py carry_out: all that follows
1 sd2core/train/data.py prepare: pairs to segments, people split
1 sd2core/denoise/scaling.py Scaling.fitted: energies to levels
2 sd2core/denoise/registry.py build: the network by its name
2 sd2core/train/denoiser_loop.py DenoiserLoop.step: a batch: loss, descent
2 sd2core/train/learner.py Learner.forward: errors of the answers
2 sd2core/denoise/s4_layer.py S4Layer.forward: (B, L, H) to (B, L, H)
1 sd2core/train/validate.py validate: epoch's end: people kept out
3 sd2core/denoise/files.py save_model: best.safetensors
3 sd2core/train/checkpoint.py write_checkpoint: last.safetensors
""",
    }.items()
}


def drawing(journey: Journey) -> Figure:
    """Stations from top to bottom, each in its column, with arrows from one to the next."""
    height_in = _ROW_IN * (len(journey.stations) + 0.6)
    figure = Figure(figsize=(_WIDTH_IN, height_in))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, _WIDTH_IN), ylim=(height_in, 0))
    axes.axis("off")
    column_in = _WIDTH_IN / len(journey.columns)
    for column, name in enumerate(journey.columns):
        x = (column + 0.5) * column_in
        axes.text(x, 0.16, name, ha="center", va="center", fontsize=10, weight="bold")
        axes.plot([x, x], [0.3, height_in], ":", color=_GREY, lw=0.6, zorder=0)
    before = None
    for row, station in enumerate(journey.stations):
        x, y = (station.column + 0.5) * column_in, _ROW_IN * (row + 1)
        corner = x - _BOX_IN[0] / 2, y - _BOX_IN[1] / 2
        face = _FACES[station.column]
        axes.add_patch(Rectangle(corner, *_BOX_IN, facecolor=face, edgecolor=_GREY, lw=0.6))
        for below_in, text, size_pt, colour in (
            (-0.14, station.function, 8, _INK),
            (0.0, station.file.partition("/")[2], 6.5, _GREY),
            (0.14, station.words, 7, _INK),
        ):
            axes.text(
                x, y + below_in, text, ha="center", va="center", fontsize=size_pt, color=colour
            )
        if before is not None and not station.later:
            arrow = {"arrowstyle": "->", "color": _INK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (x, corner[1]), before, arrowprops=arrow)
        before = (x, y + _BOX_IN[1] / 2)
    return figure


def path_of(name: str) -> Path:
    """File of a journey's drawing."""
    return HOUSE / f"{name}.svg"


def main() -> None:
    """Draw all."""
    HOUSE.mkdir(exist_ok=True)
    for name, journey in JOURNEYS.items():
        save_figure(drawing(journey), path_of(name), {"made by": "tools.documentation.journeys"})
        print(path_of(name).relative_to(REPOSITORY))


if __name__ == "__main__":
    main()
