"""Descriptions of files: one content, as facts for people and as data for programs."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.output import Report, picked, progress_bar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sd2core.files.recording_json import CameraEntry
    from sd2core.imu.signals import InertialSignals
    from sd2core.io.radar.capture import RadarCapture
    from sd2core.io.radar.kkt import RecordedMap
    from sd2core.io.video import VideoReader
    from sd2core.maps import DopplerMap, LimbMaps
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.radar_config import RadarConfig
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VelocityAxis
    from sd2core.timebase import Timebase


_SPAN = ("start_s", "end_s", "label", "person")


def describe_recording(recording: Recording, parts: list[Report]) -> Report:
    """Describe a recording and its parts; missing files are named."""
    from sd2core.recording.relinking import role_words

    missing = recording.missing()
    x, y, z = recording.sensor.position_m
    data = {
        "kind": "recording",
        "path": str(recording.folder),
        **picked(recording, "title", "subject", "simulated", "radar_offset_s"),
        **picked(recording, "radar_receiver", "radar_transmitter", "imu_offset_s"),
        "imu_places": list(recording.imu_places),
        "camera": None if recording.camera is None else recording.camera.model_dump(mode="json"),
        "sensor_position_m": [x, y, z],
        "things": [asdict(thing) for thing in recording.things],
        "bodies": [asdict(body) for body in recording.bodies],
        "walls": [asdict(wall) for wall in recording.walls],
        "denoiser": None if recording.denoiser is None else str(recording.denoiser),
        "bundled_denoiser": recording.bundled_denoiser,
        "spans": [picked(span, *_SPAN) for span in recording.labelled.decided],
        "missing": {role: str(path) for role, path in missing.items()},
    }
    data |= {part.data["kind"]: part.data for part in parts}
    beyond = _labels_beyond(recording, parts)
    data["notes"] = [*recording.notes, *beyond]
    facts = {
        "title": recording.title + (" (simulated)" if recording.simulated else ""),
        "person": recording.subject,
        "camera": _camera(recording.camera),
        "sensor": recording.sensor.words,
        "things": "; ".join(thing.words for thing in recording.things),
        "other people": "; ".join(body.words for body in recording.bodies),
        "walls": "; ".join(wall.words for wall in recording.walls),
        "radar offset": f"{recording.radar_offset_s:g} s" if recording.radar else "",
        "radar channel": recording.channel_in_words,
        "inertial sensors": ", ".join(recording.imu_places),
        "inertial offset": f"{recording.imu_offset_s:g} s" if recording.imu else "",
        "denoiser": _denoiser(recording),
        "spans": _labels(recording),
    }
    notes = tuple(f"the {role_words(role)} is not at {path}" for role, path in missing.items())
    if missing:
        notes += (f"find it with: sd2 relink {recording.folder} FOLDER",)
    notes += (*recording.notes, *beyond)
    return Report(f"Recording {recording.folder}", data, facts, notes, parts)


def describe_parts(recording: Recording, person: str | None = None) -> list[Report]:
    """Open and describe each file of a recording, as far as it is there.

    Of a scene of several the mesh is that of everybody, or of the person who is named.
    """
    missing = recording.missing()
    parts: list[Report] = []
    if recording.video is not None and "video" not in missing:
        with recording.open_video() as video:
            parts.append(describe_video(recording.video, video))
    if recording.mesh is not None and not missing.keys() & {"mesh", "faces"}:
        things, bodies = recording.things_there, recording.bodies_there
        with progress_bar("Reading the mesh") as progress:
            mesh = replace(recording, things=things, bodies=bodies).load_mesh(progress)
        mesh = mesh if person is None else mesh.body(person)
        parts.append(describe_mesh(recording.mesh, mesh))
    if recording.radar is not None and "radar" not in missing:
        parts.append(
            describe_radar(recording.radar)
            if recording.holds_radar_map
            else describe_capture(recording.radar, recording.load_capture())
        )
    if recording.imu is not None and "imu" not in missing:
        parts.append(describe_imu(recording.imu))
    return parts


def describe_video(path: Path, video: VideoReader) -> Report:
    """Describe a video."""
    from sd2core.io.video_writing import HEADS_COVERED

    data = {
        "kind": "video",
        "path": str(path),
        **picked(video, "width", "height"),
        **_clock_data(video.timebase),
        "heads_covered": (covered := video.metadata.get("comment") == HEADS_COVERED),
        "notes": list(video.notes),
    }
    facts = {
        "picture": f"{video.width} x {video.height} pixels" + (", heads covered" * covered),
        "time": video.timebase.words,
    }
    return Report(f"Video {path}", data, facts, video.notes)


def describe_mesh(path: Path, mesh: MeshSequence) -> Report:
    """Describe a mesh by its first frame; a long one is not read whole."""
    from sd2core.io.fitted import fit_of, fitted_camera

    fit = fit_of(path)
    found, stature_m = fit.get("notes"), fit.get("stature_m")
    first = mesh.frame(0)
    low, high = first.min(axis=0).tolist(), first.max(axis=0).tolist()
    face_count = 0 if mesh.faces is None else len(mesh.faces)
    data = {
        "kind": "mesh",
        "path": str(path),
        "vertices": mesh.vertex_count,
        "faces": face_count,
        **_clock_data(mesh.timebase),
        "frames_without_person": _absent(mesh.present),
        "first_frame_min_m": low,
        "first_frame_max_m": high,
        "notes": [*mesh.notes, *map(str, found if isinstance(found, list) else ())],
    }
    if fit:
        data["fit"] = fit
    if mesh.uncertainty is not None:
        data["limbs"] = list(mesh.uncertainty.limbs)
    facts = {
        "surface": f"{mesh.vertex_count:,} vertices, "
        + (f"{face_count:,} triangles" if face_count else "no triangles: a point cloud"),
        "time": mesh.timebase.words,
        "no person": _gaps(mesh.present, mesh.timebase),
        "velocities": _known_to(mesh),
        "first frame": ", ".join(
            f"{axis} {a:.2f} to {b:.2f}" for axis, a, b in zip("xyz", low, high, strict=True)
        )
        + " m",
        "camera": _camera(fitted_camera(path)),
        "stature": f"{stature_m:g} m ({fit.get('stature_source')})"
        if isinstance(stature_m, float | int)
        else "",
    }
    return Report(f"Mesh {path}", data, facts, tuple(data["notes"]))


def describe_radar(path: Path) -> Report:
    """Open a capture or a recorded map and describe it."""
    from sd2core.io.radar import holds_map, load_capture, load_recorded_map

    if holds_map(path):
        return describe_recorded_map(path, load_recorded_map(path))
    return describe_capture(path, load_capture(path))


def describe_recorded_map(path: Path, recorded: RecordedMap) -> Report:
    """Describe a recorded map and its labels."""
    inside = describe_map(path, recorded.doppler)
    spans = recorded.labels.spans
    data = inside.data | {
        "kind": "radar",
        "simulated": False,
        "gesture": recorded.gesture,
        "labels": [picked(span, *_SPAN) for span in spans],
        "notes": list(recorded.notes),
    }
    labelled = ", ".join(f"{span.start_s:.3f} to {span.end_s:.3f} s" for span in spans)
    facts = inside.facts
    if recorded.gesture:
        facts = facts | {"gesture": recorded.gesture, "labelled": labelled or "nowhere"}
    return Report(f"Radar map {path}", data, facts, recorded.notes)


def describe_imu(path: Path) -> Report:
    """Open samples of an inertial sensor and describe them."""
    from sd2core.imu.files import read_signals
    from sd2core.plausibility.samples import judge_inertial

    signals = read_signals(path)
    summary = signals_data(signals)
    data = {
        "kind": "imu",
        "path": str(path),
        **summary,
        "rate_hz": signals.rate_hz,
        "start_s": float(signals.times_s[0]),
        "end_s": float(signals.times_s[-1]),
        "meta": signals.meta,
    }
    unknown = summary["samples"] - summary["known_samples"]
    facts = {
        "samples": f"{summary['samples']:,} at {signals.rate_hz:.4g} Hz,"
        f" from {signals.times_s[0]:.3f} to {signals.times_s[-1]:.3f} s"
        + (f"; {unknown:,} are empty" if unknown else ""),
        "acceleration": f"up to {summary['largest_acceleration_mps2']:.1f} m/s²",
        "turn rate": f"up to {summary['largest_turn_rate_radps']:.2f} rad/s",
        "at": str(signals.meta.get("at", "")),
        "axes": str(signals.meta.get("axes", "")),
    }
    simulated = " (simulated)" if signals.simulated else ""
    unlikely = judge_inertial(signals.times_s, signals.acceleration_mps2, signals.turn_rate_radps)
    notes = tuple(map(str, unlikely))
    data["notes"] = list(notes)
    return Report(f"Inertial sensor {path}{simulated}", data, facts, notes)


def signals_data(signals: InertialSignals) -> dict[str, Any]:
    """Number of samples and largest values, for programs."""
    import numpy as np

    known = signals.known
    acceleration, turn_rate = (
        float(np.linalg.norm(values[known], axis=1).max(initial=0.0))
        for values in (signals.acceleration_mps2, signals.turn_rate_radps)
    )
    return {
        "samples": len(known),
        "known_samples": int(known.sum()),
        "largest_acceleration_mps2": acceleration,
        "largest_turn_rate_radps": turn_rate,
    }


def _denoiser(recording: Recording) -> str:
    if recording.denoiser is not None:
        return str(recording.denoiser)
    if recording.bundled_denoiser is None:
        return ""
    return recording.bundled_denoiser or "none"


def describe_capture(path: Path, capture: RadarCapture) -> Report:
    """Describe a radar capture and what its radar can tell apart."""
    from sd2core.fmcw import limits

    config = capture.config
    data = {
        "kind": "radar",
        "path": str(path),
        "simulated": capture.simulated,
        "radar": config.name,
        **picked(config, "receivers", "transmitters", "sampling"),
        "carrier_hz": config.centre_frequency_hz,
        **picked(config, "chirps_per_frame", "samples_per_chirp"),
        **limits(config),
        **_clock_data(capture.timebase),
        "frames_missing": capture.frames_missing,
        "start_unix_s": capture.start_unix_s,
        "notes": list(capture.notes),
    }
    facts = {
        "radar": config.name + (" (simulated)" if capture.simulated else ""),
        "samples": f"{config.samples_per_chirp} {'' if config.sampling == 'real' else 'complex '}"
        f"per chirp, {config.chirps_per_frame} chirps per frame, receivers: {config.receivers}"
        + (f", transmitters: {config.transmitters}" if config.transmitters > 1 else ""),
        "time": capture.words,
        **limit_facts(config),
    }
    return Report(f"Radar capture {path}", data, facts, tuple(capture.notes))


def describe_map(path: Path, doppler: DopplerMap) -> Report:
    """Describe a Doppler map."""
    from sd2core.io.radar.point_maps import OF_POINTS
    from sd2core.plausibility.radar import judge_map

    data = {
        "kind": "map",
        "path": str(path),
        "map_kind": doppler.kind,
        "unit": doppler.unit,
        **picked(doppler.axis, "bins", "v_max_mps"),
        "null_bins": list(doppler.null_bins),
        "unseen_bins": list(doppler.unseen_bins),
        **_clock_data(doppler.timebase),
        "frames_without_person": _absent(doppler.present),
        "accuracy": None
        if (accuracy := doppler.accuracy).total is None
        else {**asdict(accuracy), "total": accuracy.total},
        "limbs": None if doppler.limbs is None else list(doppler.limbs.parts),
        "provenance": doppler.meta,
    }
    facts = {
        "kind": doppler.kind,
        "carrier": "" if doppler.carrier_hz is None else f"{doppler.carrier_hz / 1e9:.4g} GHz",
        "velocity": axis_in_words(doppler.axis),
        "time": doppler.timebase.words,
        "no person": _gaps(doppler.present, doppler.timebase),
        "unit": doppler.unit,
        "nulled bins": bins_in_words(doppler.axis, doppler.null_bins),
        "accuracy": str(accuracy) and f"{accuracy} (relative L1)",
        "unseen bins": bins_in_words(doppler.axis, doppler.unseen_bins),
        "people": _people(doppler.meta.get("bodies")),
        "limbs": _limbs(doppler.limbs),
        **_synthesis_facts(doppler.meta),
    }
    noisy = doppler.kind == "real" and doppler.meta.get("format") != OF_POINTS
    unlikely = judge_map(doppler.values, doppler.timebase.times_s, doppler.present, measured=noisy)
    notes = (*doppler.meta.get("notes", ()), *map(str, unlikely))
    simulated = " (of a simulated recording)" if doppler.of_simulated else ""
    return Report(f"Doppler map {path}{simulated}", data, facts, notes)


def _people(bodies: Any) -> str:
    """Persons of a scene as a map's provenance tells of them."""
    people = bodies if isinstance(bodies, list) else []
    return ", ".join(str(one.get("person") if isinstance(one, dict) else one) for one in people)


def _limbs(limbs: LimbMaps | None) -> str:
    """Parts of the body in limb maps, once for all persons of whom they are the same."""
    if limbs is None:
        return ""
    of: dict[str, list[str]] = {}
    for person, one in zip(limbs.persons or ("",), limbs.by_person, strict=True):
        of.setdefault(", ".join(one.parts), []).append(person)
    return "; ".join(
        f"{parts} of {', '.join(persons)}" if any(persons) else parts
        for parts, persons in of.items()
    )


def axis_in_words(axis: VelocityAxis) -> str:
    """Bins of a velocity axis, its end and its sign."""
    return (
        f"{axis.bins} bins of {axis.bin_width_mps:g} m/s over ±{axis.v_max_mps:g} m/s,"
        " approaching is positive"
    )


def bins_in_words(axis: VelocityAxis, bins: tuple[int, ...]) -> str:
    """Numbers of bins and the velocities that they cover."""
    if not bins:
        return ""
    # Rounded: an edge at 0 may be computed as 1e-17.
    edges_mps = [f"{round(edge, 9) + 0.0:g}" for edge in axis.edges_mps.tolist()]
    firsts = [edges_mps[number] for number in bins if number - 1 not in bins]
    ends = [edges_mps[number + 1] for number in bins if number + 1 not in bins]
    spans = (f"{first} to {end}" for first, end in zip(firsts, ends, strict=True))
    return f"{', '.join(map(str, bins))}: {', '.join(spans)} m/s"


def _synthesis_facts(provenance: dict[str, Any]) -> dict[str, str]:
    if provenance.get("visible_share") is None:
        return {}
    from statistics import fmean

    from sd2core.sensor import VirtualSensor

    sensor = provenance.get("sensor")
    words = VirtualSensor.from_dict(sensor).words if isinstance(sensor, dict) else ""
    visible, beyond = provenance["visible_share"], provenance.get("beyond_share") or 0.0
    beyond = beyond if isinstance(beyond, list) else [beyond]
    worst = max(range(len(beyond)), key=beyond.__getitem__)
    stride = provenance.get("mask_stride", 1)
    shared = "" if stride == 1 else f", computed for one frame in {stride}"
    plan = provenance.get("plan")
    return {
        "plan": "" if plan is None else plan["text"],
        # Both are the same map of a mesh that says nothing.
        "count": provenance.get("count", "") if "body_error_l1" in provenance else "",
        "sensor": words,
        "visibility": f"{provenance.get('visibility') or 'not stated'}:"
        f" {fmean(visible):.1%} visible on average" + shared,
        "beyond axis": f"{fmean(beyond):.1%} of what is visible on average"
        + (f", {beyond[worst]:.1%} in frame {worst}" if beyond[worst] > 0 else ""),
    }


def limit_facts(config: RadarConfig) -> dict[str, str]:
    """Limits that follow from a radar's configuration, for people."""
    reach = (
        "none: a continuous wave tells no ranges apart"
        if config.is_continuous
        else f"up to R_max {config.range_max_m:.2f} m,"
        f" in steps ΔR of {config.range_resolution_m:.3f} m"
    )
    return {
        "wavelength λ": f"{config.wavelength_m * 1e3:.3f} mm,"
        f" at {config.centre_frequency_hz / 1e9:.4g} GHz",
        "radar velocity": f"up to v_max ±{config.v_max_mps:.3f} m/s,"
        f" in steps Δv of {config.velocity_resolution_mps:.3f} m/s",
        "radar range": reach,
    }


def _camera(camera: CameraEntry | None) -> str:
    if camera is None:
        return ""
    size = f" at {camera.width} x {camera.height}" if camera.width and camera.height else ""
    source = f" ({camera.source})" if camera.source else ""
    return f"focal length {camera.focal_px:.0f} pixels{size}{source}"


def _known_to(mesh: MeshSequence) -> str:
    """Accuracy of velocities along the camera's line of sight: best and worst limb."""
    known = mesh.uncertainty
    if known is None:
        return ""
    typical = (known.along_mps[mesh.presence.present] ** 2).mean(axis=0) ** 0.5
    best, worst = int(typical.argmin()), int(typical.argmax())
    words = "along the camera's line of sight known to"
    if typical[best] == typical[worst]:
        return f"{words} ±{typical[best]:.2f} m/s"
    return (
        f"{words} ±{typical[best]:.2f} m/s ({known.limbs[best]})"
        f" to ±{typical[worst]:.2f} m/s ({known.limbs[worst]})"
    )


def _absent(present: NDArray[np.bool_] | None) -> int:
    """Frames without a person."""
    return 0 if present is None else int((~present).sum())


def _gaps(present: NDArray[np.bool_] | None, timebase: Timebase) -> str:
    """Share of a clip without a person and the first such time; empty without gaps."""
    from sd2core.mesh.presence import gaps_in_words, runs

    if present is None:
        return ""
    gaps = runs(~present)
    first_s = timebase.time_of(gaps[0][0])
    share = gaps_in_words(gaps, timebase.times_s, timebase.frame_duration_s)
    return f"in {share}, first at {first_s:.2f} s"


def _labels(recording: Recording) -> str:
    counts = Counter(span.label for span in recording.labelled.decided)
    return ", ".join(f"{count} x {label}" for label, count in counts.items())


def _labels_beyond(recording: Recording, parts: list[Report]) -> tuple[str, ...]:
    """Notes on labels beyond all parts, on the recording's clock."""
    from sd2core.plausibility.spans import judge_spans

    offsets_s = {"radar": recording.radar_offset_s, "imu": recording.imu_offset_s}
    times_s = [
        (start_s, start_s + float(part.data["duration_s"]))
        for part in parts
        if "duration_s" in part.data
        for start_s in [float(part.data["start_s"]) + offsets_s.get(part.data["kind"], 0.0)]
    ]
    if not times_s:
        return ()
    spans_s = [(span.start_s, span.end_s) for span in recording.labelled.spans]
    first_s, last_s = min(start for start, _ in times_s), max(end for _, end in times_s)
    return tuple(map(str, judge_spans(spans_s, first_s, last_s)))


def _clock_data(timebase: Timebase) -> dict[str, float]:
    return {"frames": len(timebase), **picked(timebase, "start_s", "duration_s", "frames_per_s")}
