"""Options that several commands take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from sd2core.files.figure_files import SUFFIXES as FIGURES
from sd2core.files.turns import Turn
from sd2core.options.bounds import Bounds
from sd2core.options.kinds import Count, ImageSize, Names, Natural, Positive, Text, Vector
from sd2core.options.records import ARGUMENT, Group, OptionError, OptionRecord, Place


class Json(OptionRecord):
    """How a result is printed.

    Parameters
    ----------
    json
        print JSON; an error as well
    """

    json: bool = False


class JsonAndProgress(Json):
    """How a result, and the way to it, are printed.

    Parameters
    ----------
    progress_json
        print progress as JSON lines, for other programs (docs/formats.md)
    """

    json: Annotated[bool, Place(one_of="json")] = False
    progress_json: Annotated[bool, Place(one_of="json")] = False


class Overwrite(OptionRecord):
    """Treatment of outputs that exist: without the option they are refused.

    Parameters
    ----------
    overwrite
        replace outputs that exist
    """

    # It was called --replace where labels are written.
    overwrite: Annotated[bool, Place(("--overwrite", "--replace"))] = False


class Sensor(OptionRecord):
    """Place of the radar.

    Parameters
    ----------
    sensor : X,Y,Z
        where the radar is, in metres (default: the recording's sensor, or the camera)
    """

    sensor: Vector | None = None


class Looking(OptionRecord):
    """Direction and beam of the radar.

    Parameters
    ----------
    aim : AZ,EL
        direction in degrees, to the right of the camera's axis and above the horizon, or body, at
        the body's centre (default: the recording's, or ahead); it counts with a beam only
    beam : BEAM
        pattern of its antennas: widths at half power as AZ,EL in degrees, a table (.csv) of
        angle_deg, azimuth_db, elevation_db, iwr1443 (its board's), or none, all directions alike
        (default: the recording's, or none)
    """

    aim: str | None = None
    beam: str | None = None


class MeshReading(OptionRecord):
    """Facts that a mesh file may not state.

    Parameters
    ----------
    faces : FILE
        triangles (.npy or .obj) for a mesh that has none of its own
    fps : FPS
        frames per second of a mesh that does not say
    scale : M
        metres per unit of the mesh, e.g. 0.001 for millimetres (default: 1)
    person : ID
        which person of a file, or of a folder with a file per person and frame (default: seen
        longest), or, by name, of a recording of several (default: everybody)
    distance_m : M
        move a mesh that is centred on the body's root this far forward
    turn : AXIS
        turn the mesh about an axis: x180 where y is up and z backward (OBJ and PLY files of
        4D-Humans, VIBE and SAM 3D Body), x90 where z is up
    image_size : WxH
        size of the video in pixels, to place the output of an estimator (default: that of the
        recording's video)
    focal_px : PX
        focal length of the video in pixels, likewise (default: the file's, or the diagonal)
    body_model : FILE
        model of SMPL, SMPL-H, SMPL-X (.npz, .pkl) or MHR (.pt, TorchScript: a program, which is
        run), to make vertices of body parameters
    """

    GROUP = Group("mesh file", "what it may not say about itself")

    faces: Path | None = None
    fps: Positive | None = None
    scale: Positive | None = None
    person: str | None = None
    distance_m: float | None = None
    turn: Turn | None = None
    image_size: ImageSize | None = None
    focal_px: Positive | None = None
    body_model: Path | None = None


class MeshInput(MeshReading):
    """Mesh that is looked at.

    Parameters
    ----------
    mesh : MESH
        a mesh, or a recording
    """

    mesh: Annotated[Path, ARGUMENT]


class MeshAndSensor(Looking, Sensor, MeshInput):
    """Mesh that is looked at, and the place of the sensor."""


class ReplacesMaps(Overwrite):
    """Output that replaces nothing but a Doppler map."""


class MapOutput(ReplacesMaps):
    """Doppler map to write.

    Parameters
    ----------
    out : FILE.npz
        the map to write
    """

    out: Annotated[Path, Place(endings=(".npz",))]


class Figure(Overwrite):
    """Picture of a result.

    Parameters
    ----------
    figure : FILE
        draw the result, as .png, .svg or .pdf
    """

    figure: Annotated[Path | None, Place(endings=FIGURES)] = None


class Axis(OptionRecord):
    """The velocity axis.

    Parameters
    ----------
    bins : N
        velocity bins (default: 32)
    v_max_mps : MPS
        end of the velocity axis in m/s (default: 2)
    """

    bins: Count | None = None
    v_max_mps: Annotated[Positive | None, Place(("--v-max",))] = None


class Channel(OptionRecord):
    """Channel of a radar.

    Parameters
    ----------
    receiver : N
        take this receiver, counted from 1 (default: the mean power of all)
    transmitter : N
        take this transmitter, likewise
    """

    receiver: Count | None = None
    transmitter: Count | None = None


class Method(OptionRecord):
    """How Doppler is computed.

    Parameters
    ----------
    method
        count vertices, or simulate the radar's signal
    """

    method: Literal["histogram", "fmcw"] = "histogram"


class SegmentFrames(OptionRecord):
    """How recordings are cut into windows.

    Parameters
    ----------
    segment_frames : N
        length of a segment
    overlap_frames : N
        frames that neighbours share
    """

    segment_frames: Annotated[int, Bounds(2, 10_000, whole=True)] = 72
    overlap_frames: Annotated[int, Bounds(0, 9_999, whole=True)] = 10

    @property
    def windowed(self) -> bool:
        """True if segments are windows, which may share frames."""
        return True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.windowed and self.overlap_frames >= self.segment_frames:
            raise OptionError(
                f"overlap_frames is {self.overlap_frames}",
                f"less than segment_frames, which is {self.segment_frames}",
            )


class Limbs(OptionRecord):
    """Maps of the parts of the body.

    Parameters
    ----------
    limbs
        also keep the synthetic map of each part of the body (trunk, upper arms, forearms,
        thighs, lower legs)
    """

    limbs: bool = False


class Denoising(OptionRecord):
    """How maps are denoised: section ``[denoise]`` of a plan, and options of ``sd2 denoise``.

    Parameters
    ----------
    model : FILE|NAME
        a model file from `sd2 train`, or the name of one that is installed (default: of those
        that come with SD² Studio the one for limb maps, where there are such)
    texture : SEED
        draw denoised maps as a radar would show them, with its speckle and gaps, instead of
        the mean (SEED of the random numbers: 0)
    """

    model: Text | None = None
    texture: Annotated[Natural | None, Place(bare=0)] = None


class RadarChoice(OptionRecord):
    """Radar to simulate.

    Parameters
    ----------
    radar : NAME|CONFIG.json
        a radar by its name (paper, bgt60, iwr6843, iwr1443, a121, k-band, cw-5.8ghz, wifi-5ghz,
        wifi-2.4ghz; docs/radar-files.md), or that of a capture's config.json (default: paper)
    """

    radar: Text = "paper"


class Simulating(RadarChoice):
    """A radar and its noise: section ``[simulate]`` of a plan, and options of a command.

    Parameters
    ----------
    seed : N
        seed of noise and random phases
    """

    seed: Natural = 0


class KeptOut(OptionRecord):
    """People that are not learnt from.

    Parameters
    ----------
    validation_subjects : LIST
        kept out for validation, separated by commas, or none (default: as the data set says,
        or a sixth of all)
    test_subjects : LIST
        kept out for a test, or none (default: as the data set says, or a sixth of all)
    """

    validation_subjects: Names | None = None
    test_subjects: Names | None = None
