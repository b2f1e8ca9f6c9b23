from __future__ import annotations

import random
import struct
import threading
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import psutil
import pytest
from numbered_videos import number_in, picture, write_video

from sd2core.errors import Sd2Error
from sd2core.io import video, video_index
from sd2core.io.video import open_video
from sd2core.progress import Cancelled

UNEVEN_MS = np.cumsum([0, *random.Random(3).choices([11, 33, 34, 70, 240], k=59)]).tolist()

# name, frames, how it is written
FILES = {
    "b_frames.mp4": (60, {"options": {"bf": "3", "g": "12", "b-pyramid": "normal"}}),
    "one_gop.mkv": (60, {"options": {"bf": "3", "g": "600"}}),
    "open_gop.mkv": (60, {"options": {"bf": "3", "x264-params": "open-gop=1:keyint=12"}}),
    "short_gop.mp4": (60, {"options": {"bf": "3", "g": "5", "sc_threshold": "0"}}),
    "short_gop.mkv": (60, {"options": {"bf": "3", "g": "5", "sc_threshold": "0"}}),
    "uneven.mp4": (60, {"times_ms": UNEVEN_MS, "options": {"bf": "3", "g": "12"}}),
    "uneven.mkv": (60, {"times_ms": UNEVEN_MS, "options": {"bf": "2", "g": "10"}}),
    "transport.ts": (60, {"options": {"bf": "2", "g": "10"}}),
    "old.avi": (60, {"codec": "mpeg4", "options": {"bf": "2", "g": "12"}}),
    "intra.avi": (60, {"codec": "mjpeg", "pixels": "yuvj420p"}),
    "alt_ref.webm": (60, {"codec": "libvpx", "options": {"auto-alt-ref": "1"}}),
    "hevc.mp4": (30, {"codec": "libx265", "options": {"x265-params": "log-level=0:keyint=8"}}),
    "odd_size.mkv": (20, {"codec": "ffv1", "size": (131, 67)}),
    "one_frame.mp4": (1, {}),
    "no_times.h264": (60, {"options": {"bf": "2", "g": "10"}}),
    "wrong_times.avi": (60, {"options": {"bf": "2", "g": "10"}}),
}


@pytest.fixture(params=["whole", "ends"])
def listing(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways of listing frames: all decoded, or packets with decoded ends."""
    if request.param == "ends":
        monkeypatch.setattr(video_index, "_WHOLE_MEGAPIXELS", 0.0)
    return str(request.param)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where each of the files is written once."""
    return tmp_path_factory.mktemp("videos")


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", FILES)
def test_random_access_is_frame_exact(folder: Path, name: str, listing: str) -> None:
    frames, how = FILES[name]
    if not (path := folder / name).exists():
        write_video(path, frames, **how)
    with open_video(path) as reader:
        assert len(reader) == frames
        assert (reader.width, reader.height) == how.get("size", (128, 64))
        shuffled = list(range(frames)) * 2
        random.Random(1).shuffle(shuffled)
        assert [number_in(reader.read(k)) for k in shuffled] == shuffled
        assert [number_in(image) for image in reader.frames()] == list(range(frames))


def test_access_without_a_cache_equals_sequential_decoding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video, "_CACHE_BYTES", 0)
    path = write_video(tmp_path / "v.mp4", 60, options={"bf": "3", "g": "12"})
    with open_video(path) as reader, av.open(str(path)) as container:
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        shuffled = random.Random(2).sample(range(60), 60)
        for k in shuffled:
            np.testing.assert_array_equal(reader.read(k), decoded[k])


@pytest.mark.parametrize("name", ["uneven.mp4", "uneven.mkv"])
def test_presentation_times_are_those_written(tmp_path: Path, name: str) -> None:
    frames, how = FILES[name]
    with open_video(write_video(tmp_path / name, frames, **how)) as reader:
        np.testing.assert_allclose(reader.timebase.times_s, np.array(UNEVEN_MS) / 1000, atol=1e-9)


def test_a_regular_clock_is_freed_of_the_containers_rounding(tmp_path: Path) -> None:
    """Matroska keeps whole milliseconds."""
    with open_video(write_video(tmp_path / "v.mkv", 40)) as reader:
        np.testing.assert_allclose(reader.timebase.times_s, np.arange(40) / 30, atol=1e-12)


def test_also_where_frames_follow_each_other_as_fast_as_milliseconds(tmp_path: Path) -> None:
    with open_video(write_video(tmp_path / "v.mkv", 40, rate=400)) as reader:
        np.testing.assert_allclose(reader.timebase.times_s, np.arange(40) / 400, atol=1e-12)


def test_first_frame_is_at_zero_when_the_file_starts_later(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mkv", 10, times_ms=[500 + 100 * k for k in range(10)])
    with open_video(path) as reader:
        np.testing.assert_allclose(reader.timebase.times_s, np.arange(10) / 10, atol=1e-9)
        assert number_in(reader.read(0)) == 0


@pytest.mark.parametrize("told", [b"00:00:01.3330000.1", b"00:00:............"])
def test_a_duration_that_is_no_time_is_as_good_as_none(tmp_path: Path, told: bytes) -> None:
    path = write_video(tmp_path / "v.mkv", 40)
    whole = path.read_bytes()
    assert b"00:00:01.333000000" in whole
    path.write_bytes(whole.replace(b"00:00:01.333000000", told))
    with open_video(path) as reader:
        assert len(reader) == 40


def test_a_file_without_times_says_so(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.h264", 10)
    with open_video(path) as reader:
        assert "no usable frame times" in reader.notes[0]
        assert "25 frames/s" in reader.notes[0]
        np.testing.assert_allclose(reader.timebase.times_s, np.arange(10) / 25)


def test_an_edit_list_hides_the_frames_it_cuts(tmp_path: Path, listing: str) -> None:
    whole = write_video(tmp_path / "whole.mp4", 60, options={"bf": "3", "g": "20"})
    cut = tmp_path / "cut.mp4"
    # Copying packets from before zero makes the muxer write an edit list.
    with av.open(str(whole)) as source, av.open(str(cut), "w") as target:
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        shift = int(7 / 30 / stream.time_base)
        for packet in source.demux(stream):
            if packet.dts is None:
                continue
            packet.pts -= shift
            packet.dts -= shift
            packet.stream = copy
            target.mux(packet)
    with av.open(str(cut)) as container:
        expected = [number_in(f.to_ndarray(format="rgb24")) for f in container.decode(video=0)]
    with open_video(cut) as reader:
        order = random.Random(4).sample(range(len(expected)), len(expected))
        assert len(reader) == len(expected)
        assert [number_in(reader.read(k)) for k in order] == [expected[k] for k in order]


@pytest.mark.parametrize("suffix", ["mkv", "ts"])
def test_a_truncated_file_is_read_to_its_true_end(
    tmp_path: Path, suffix: str, listing: str
) -> None:
    path = write_video(tmp_path / f"v.{suffix}", 60, options={"bf": "2", "g": "10", "crf": "5"})
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * 0.6)])
    with open_video(path) as reader:
        count = len(reader)
        assert 20 < count < 50
        read = [number_in(image) for image in reader.frames()]
        assert read[: count - 3] == list(range(count - 3))
        assert number_in(reader.read(3)) == 3


@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
def test_a_cut_regular_video_keeps_its_clock_and_says_what_is_missing(
    tmp_path: Path, share: float, listing: str
) -> None:
    path = write_video(tmp_path / "v.mkv", 90, options={"bf": "3", "g": "600", "crf": "5"})
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    with open_video(path) as reader:
        places = reader.timebase.times_s * 30
        np.testing.assert_allclose(places, np.rint(places), atol=1e-9)
        claim = f"claims 90 frames, {len(reader)} decode; it is used up to its last frame"
        assert any(claim in note for note in reader.notes)
        missing = round(places[-1]) + 1 - len(reader)
        assert any(f"{missing} frame" in note for note in reader.notes) == (missing > 0)


def test_a_frame_missing_inside_leaves_a_hole_in_a_regular_clock(
    tmp_path: Path, listing: str
) -> None:
    whole = write_video(tmp_path / "whole.mkv", 60, codec="mjpeg", pixels="yuvj420p")
    cut = tmp_path / "cut.mkv"
    with av.open(str(whole)) as source, av.open(str(cut), "w") as target:
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        for number, packet in enumerate(source.demux(stream)):
            if packet.size and number not in (10, 20, 21):
                packet.stream = copy
                target.mux(packet)
    kept = [k for k in range(60) if k not in (10, 20, 21)]
    with open_video(cut) as reader:
        assert [number_in(image) for image in reader.frames()] == kept
        np.testing.assert_allclose(reader.timebase.times_s, np.array(kept) / 30, atol=1e-12)
        assert "3 frames are missing inside, the longest gap from 0.63 s to 0.73 s" in str(
            reader.notes
        )


def test_every_second_frame_of_a_clock_is_no_damage(tmp_path: Path) -> None:
    times_ms = [round(2000 * k / 30) for k in range(30)]
    path = write_video(tmp_path / "v.mkv", 30, rate=30, times_ms=times_ms)
    with open_video(path) as reader:
        np.testing.assert_allclose(reader.timebase.times_s, np.arange(30) / 15, atol=1e-12)
        assert reader.notes == ()


def test_a_cut_uneven_video_says_how_long_it_should_last(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mkv", 60, times_ms=UNEVEN_MS, options={"crf": "5"})
    with open_video(path) as reader:
        assert reader.notes == ()
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with open_video(path) as reader:
        last_s = reader.timebase.times_s[-1]
        lasts_s = UNEVEN_MS[-1] / 1000
        assert reader.notes == (
            f"The file claims to last {lasts_s:.1f} s; its last frame that decodes is at "
            f"{last_s:.1f} s.",
        )


def test_a_video_cut_to_its_first_frame_says_how_long_it_should_last(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mkv", 90)
    content = path.read_bytes()
    with open_video(path) as reader:
        assert reader.notes == ()
    for share in range(1, 40):
        path.write_bytes(content[: share * len(content) // 40])
        try:
            with open_video(path) as reader:
                notes, frames = reader.notes, len(reader)
        except Sd2Error:
            continue
        break
    assert frames == 1
    assert notes == ("The file claims to last 3.0 s; its last frame that decodes is at 0.0 s.",)


def test_a_late_start_is_no_claim_of_more_frames(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mkv", 30, times_ms=[500 + round(k / 0.03) for k in range(30)])
    with open_video(path) as reader:
        assert len(reader) == 30
        assert reader.notes == ()


@pytest.mark.parametrize(("name", "b_frames", "where"), [("v.mp4", 3, 0.6), ("v.mkv", 2, 0.4)])
def test_damage_inside_leaves_the_other_frames_at_their_times(
    tmp_path: Path, name: str, b_frames: int, where: float
) -> None:
    steps_ms = random.Random(3).choices([11, 33, 34, 70, 240], k=149)
    times_ms = np.cumsum([0, *steps_ms]) if name == "v.mkv" else np.arange(150) / 0.03
    options = {"bf": str(b_frames), "g": "30", "crf": "1"}
    how = {"times_ms": times_ms.tolist()} if name == "v.mkv" else {}
    path = write_video(tmp_path / name, 150, options=options, **how)
    content = bytearray(path.read_bytes())
    place = int(len(content) * where)
    content[place : place + 200] = bytes(200)
    path.write_bytes(content)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        shown = [frame.pts for frame in video_index.decoded_frames(container, stream)]
        assert shown != sorted(shown)  # the decoder shows frames out of turn
        tick_s = float(stream.time_base)
    with open_video(path) as reader:
        np.testing.assert_allclose(
            reader.timebase.times_s, np.array(sorted(shown)) * tick_s, atol=1e-3
        )
        assert "The file is damaged: some frames come out of turn" in reader.notes[0]
        assert "from " in reader.notes[1]
        images = [number_in(image) for image in reader.frames()]
        # Some pictures right after the damage are wrong themselves; the others are in place.
        off_ms = np.abs(times_ms[images] - 1e3 * reader.timebase.times_s)
        right = (off_ms < 2).tolist()
        assert all(right[:40])
        assert all(right[-60:-20])
        assert sum(right) >= len(reader) - 10
        shuffled = random.Random(6).sample(range(len(reader)), len(reader))
        assert [number_in(reader.read(k)) for k in shuffled] == [images[k] for k in shuffled]


def test_frames_before_the_first_key_frame_are_not_listed(tmp_path: Path, listing: str) -> None:
    options = {"bf": "0", "g": "20", "sc_threshold": "0"}
    whole = write_video(tmp_path / "whole.mkv", 60, options=options)
    cut = tmp_path / "cut.mkv"
    with av.open(str(whole)) as source, av.open(str(cut), "w") as target:
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        for number, packet in enumerate(source.demux(stream)):
            if number >= 13 and packet.size:
                packet.stream = copy
                target.mux(packet)
    with open_video(cut) as reader:
        assert [number_in(image) for image in reader.frames()] == list(range(20, 60))
        assert reader.timebase.start_s == 0.0


def test_a_damaged_frame_inside_is_replaced_by_the_one_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video_index, "_WHOLE_MEGAPIXELS", 0.0)
    monkeypatch.setattr(video_index, "_HEAD_PACKETS", 8)
    path = write_video(tmp_path / "v.mkv", 60, codec="mjpeg", pixels="yuvj420p")
    content = bytearray(path.read_bytes())
    with av.open(str(path)) as container:
        packet = [p for p in container.demux(video=0) if p.size][30]
        place = content.find(bytes(packet))
        size = packet.size
    content[place : place + size] = bytes(size)
    path.write_bytes(content)
    with open_video(path) as reader:
        assert len(reader) == 60
        assert reader.notes == ()
        assert [number_in(reader.read(k)) for k in (29, 30, 31, 45, 30)] == [29, 29, 31, 45, 29]
        assert reader.notes == ("Frame 30 is damaged; frame 29 is shown in its place.",)


@pytest.mark.parametrize(("degrees", "turns"), [(90, 1), (180, 2), (-90, 3)])
def test_rotation_is_honoured(tmp_path: Path, degrees: int, turns: int) -> None:
    path = write_video(tmp_path / "v.mp4", 3, options={"crf": "1"}, rotation=degrees)
    expected = np.rot90(picture(2, 128, 64), turns)
    with open_video(path) as reader:
        image = reader.read(2)
        assert image.shape == (reader.height, reader.width, 3) == expected.shape
        assert np.abs(image.astype(int) - expected).mean() < 12


def with_matrix(path: Path, rows: tuple[int, int, int, int]) -> None:
    """Write a display matrix into the track's header of an MP4."""
    content = bytearray(path.read_bytes())
    at = content.find(b"tkhd") + 44  # version 0: what stands before the matrix
    a, b, c, d = (one << 16 for one in rows)
    content[at : at + 36] = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)
    path.write_bytes(content)


@pytest.mark.parametrize(
    "rows",
    [(1, 0, 0, 1), (-1, 0, 0, 1), (1, 0, 0, -1), (-1, 0, 0, -1),
     (0, 1, 1, 0), (0, -1, 1, 0), (0, 1, -1, 0), (0, -1, -1, 0)],
)  # fmt: skip
def test_pictures_are_turned_and_mirrored(tmp_path: Path, rows: tuple[int, int, int, int]) -> None:
    path = write_video(tmp_path / "v.mp4", 3, options={"crf": "1"})
    with_matrix(path, rows)
    stored = picture(2, 128, 64)
    a, b, c, d = rows
    y, x = np.indices(stored.shape[:2])
    shown_x, shown_y = a * x + c * y, b * x + d * y
    shown_x, shown_y = shown_x - shown_x.min(), shown_y - shown_y.min()
    expected = np.empty((shown_y.max() + 1, shown_x.max() + 1, 3), np.uint8)
    expected[shown_y, shown_x] = stored
    with open_video(path) as reader:
        image = reader.read(2)
        assert image.shape == (reader.height, reader.width, 3) == expected.shape
        assert np.abs(image.astype(int) - expected).mean() < 12
        assert ["mirrored" in note for note in reader.notes] == [True] * (a * d - b * c < 0)


@pytest.mark.parametrize(("rotation", "shown"), [(None, (64, 171)), (90, (171, 64))])
def test_pixels_that_are_not_square_are_stretched(
    tmp_path: Path, rotation: int | None, shown: tuple[int, int]
) -> None:
    """A body is measured in a picture; one squeezed by a camera would be a slim one."""
    path = tmp_path / "v.mp4"
    write_video(path, 3, options={"crf": "1"}, rotation=rotation, aspect=Fraction(4, 3))
    with open_video(path) as reader:
        image = reader.read(2)
        assert (reader.height, reader.width) == image.shape[:2] == shown
        assert number_in(np.rot90(image, 0 if rotation is None else -1)) == 2
        assert any(f"stretched to {shown[1]} × {shown[0]}" in note for note in reader.notes)


@pytest.mark.parametrize(
    ("taken", "times"), [("240.0", "0.125"), ("1", "30"), ("29.97", ""), ("-", "")]
)
def test_slow_motion_and_time_lapse_say_so(tmp_path: Path, taken: str, times: str) -> None:
    """Else a newcomer's velocities would be wrong by that factor."""
    write_video(
        tmp_path / "v.mp4",
        4,
        metadata={"com.android.capture.fps": taken},
        container_options={"movflags": "use_metadata_tags"},
    )
    with open_video(tmp_path / "v.mp4") as reader:
        assert [f"{times} times as fast" in note for note in reader.notes] == [True] * bool(times)


def test_an_interlaced_picture_says_so(tmp_path: Path) -> None:
    options = {"flags": "+ilme+ildct"}
    write_video(tmp_path / "v.mpg", 3, codec="mpeg2video", rate=25, options=options)
    with open_video(tmp_path / "v.mpg") as reader:
        assert any("interlaced" in note for note in reader.notes)


def test_colours_are_red_green_blue(tmp_path: Path) -> None:
    path = tmp_path / "v.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = 32, 32, "bgr0"
        image = np.zeros((32, 32, 3), np.uint8)
        image[...] = (250, 120, 10)
        container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())
    with open_video(path) as reader:
        np.testing.assert_array_equal(reader.read(0), image)


def test_what_is_returned_is_the_callers_own(tmp_path: Path) -> None:
    with open_video(write_video(tmp_path / "v.mp4", 3)) as reader:
        first = reader.read(1)
        kept = first.copy()
        first[...] = 0
        np.testing.assert_array_equal(reader.read(1), kept)


def test_the_cache_keeps_to_its_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frame_bytes = 128 * 64 * 3 // 2
    monkeypatch.setattr(video, "_CACHE_BYTES", 6 * frame_bytes)
    with open_video(write_video(tmp_path / "v.mp4", 60, options={"g": "30"})) as reader:
        for k in (59, 10, 40):
            reader.read(k)
            assert 0 < reader._cached_bytes <= 6 * frame_bytes
            assert reader._cached_bytes == sum(size for _, size in reader._cache.values())


def test_reading_on_starts_no_threads(tmp_path: Path) -> None:
    with open_video(write_video(tmp_path / "v.mp4", 40, options={"bf": "2", "g": "10"})) as reader:
        reader.read(0)
        process = psutil.Process()
        before = process.num_threads()
        for k in range(40):
            reader.read(k)
        assert process.num_threads() <= before


def test_threads_read_their_own_frames(tmp_path: Path) -> None:
    reader = open_video(write_video(tmp_path / "v.mp4", 60, options={"bf": "2", "g": "10"}))
    wrong: list[tuple[int, int]] = []

    def read(seed: int) -> None:
        for k in random.Random(seed).sample(range(60), 30):
            found = number_in(reader.read(k))
            if found != k:
                wrong.append((k, found))

    threads = [threading.Thread(target=read, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    reader.close()
    assert wrong == []


def test_longer_sound_is_no_claim_of_more_frames(tmp_path: Path) -> None:
    path = tmp_path / "v.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 128, 64, "yuv420p"
        sound = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        for k in range(10):
            frame = av.VideoFrame.from_ndarray(picture(k, 128, 64), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        for k in range(20):
            frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), "s16", "mono")
            frame.sample_rate, frame.pts = 8000, 800 * k
            container.mux(sound.encode(frame))
        container.mux(sound.encode())
    with open_video(path) as reader:
        assert [number_in(image) for image in reader.frames()] == list(range(10))
        assert reader.notes == ()


def test_a_file_that_vanishes_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(video, "_CACHE_BYTES", 0)
    path = write_video(tmp_path / "v.mp4", 30, options={"g": "10"})
    with open_video(path) as reader:
        reader.read(25)
        path.rename(tmp_path / "elsewhere.mp4")
        with pytest.raises(Sd2Error, match=r"v\.mp4 does not exist"):
            reader.read(2)
        (tmp_path / "elsewhere.mp4").rename(path)
        assert number_in(reader.read(2)) == 2


def test_a_playlist_opens_no_connection(tmp_path: Path) -> None:
    path = tmp_path / "list.m3u8"
    path.write_text(
        "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nhttp://localhost:9/a.ts\n#EXT-X-ENDLIST\n"
    )
    with pytest.raises(Sd2Error, match=r"list\.m3u8"):
        open_video(path)


def test_a_closed_reader_says_so(tmp_path: Path) -> None:
    reader = open_video(write_video(tmp_path / "v.mp4", 3))
    reader.close()
    reader.close()
    with pytest.raises(Sd2Error, match=r"v\.mp4 is closed"):
        reader.read(0)


def test_frames_outside_the_file_are_refused(tmp_path: Path) -> None:
    with open_video(write_video(tmp_path / "v.mp4", 3)) as reader:
        for k in (-1, 3):
            with pytest.raises(IndexError, match=f"frame {k} of 3"):
                reader.read(k)


@pytest.mark.parametrize("content", [b"", b"hello, this is text\n" * 50, bytes(range(256)) * 40])
def test_what_is_no_video_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "not_a_video.mp4"
    path.write_bytes(content)
    with pytest.raises(Sd2Error, match=r"not_a_video\.mp4.*Expected: a .*video"):
        open_video(path)


def test_a_file_of_sound_only_is_named(tmp_path: Path) -> None:
    path = tmp_path / "sound.wav"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), "s16", "mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(Sd2Error, match=r"sound\.wav holds no video stream"):
        open_video(path)


def test_an_unknown_codec_is_named(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mp4", 3)
    path.write_bytes(path.read_bytes().replace(b"avc1", b"zzzz"))
    with pytest.raises(Sd2Error, match=r"v\.mp4 holds video of a kind that FFmpeg does not decode"):
        open_video(path)


def test_missing_files_and_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"gone\.mp4 does not exist"):
        open_video(tmp_path / "gone.mp4")
    with pytest.raises(Sd2Error, match="is a folder"):
        open_video(tmp_path)


def test_listing_can_be_cancelled(tmp_path: Path) -> None:
    path = write_video(tmp_path / "v.mp4", 40)

    def stop(done: int, total: int) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        open_video(path, progress=stop)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("name", "frames", "notes"),
    [
        ("again.mkv", 77, 1),
        ("help.mkv", 58, 0),
        ("walk.mkv", 89, 0),
    ],
)
def test_real_videos(shared_data: Path, listing: str, name: str, frames: int, notes: int) -> None:
    path = shared_data / "video" / name
    with open_video(path) as reader, av.open(str(path)) as container:
        assert len(reader) == frames
        assert (reader.width, reader.height) == (640, 480)
        np.testing.assert_allclose(reader.timebase.times_s, np.arange(frames) / 30, atol=1e-9)
        assert len(reader.notes) == notes
        if notes:
            assert "claims 78 frames, 77 decode" in reader.notes[0]
        decoded = list(container.decode(video=0))
        for k in random.Random(5).sample(range(frames), 12):
            np.testing.assert_array_equal(reader.read(k), decoded[k].to_ndarray(format="rgb24"))
