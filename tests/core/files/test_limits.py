"""What is opened is a regular file, and what it declares is no more than it can hold."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.files.limits import (
    DEFAULT_LIMIT_BYTES,
    VARIABLE,
    check_regular,
    check_regular_within,
    check_size,
    read_limit_bytes,
)
from sd2core.files.texts import read_text
from sd2core.io.kinds import kind_of
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.io.radar import load_capture
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    (folder / "whole").write_text("x")
    os.mkfifo(folder / "pipe.npz")
    return folder / "pipe.npz"


def test_a_pipe_is_refused_before_it_is_opened(pipe: Path) -> None:
    with pytest.raises(Sd2Error, match=r"pipe\.npz is a named pipe.*regular file"):
        check_regular(pipe)
    with pytest.raises(Sd2Error, match=r"pipe\.npz is a named pipe"):
        check_regular_within(pipe.parents[2])
    with pytest.raises(Sd2Error, match=r"pipe\.npz is a named pipe"):
        kind_of(pipe)


def test_files_folders_links_and_what_is_missing_are_not_refused(pipe: Path) -> None:
    link = pipe.parent / "link"
    link.symlink_to(pipe.parent / "whole")
    pipe.unlink()
    for path in (link, pipe.parent, pipe, pipe / "none", Path("with\0nul")):
        check_regular(path)
    check_regular_within(pipe.parents[2])


def test_a_device_behind_a_link_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "radar.npy"
    link.symlink_to("/dev/zero")
    with pytest.raises(Sd2Error, match=r"radar\.npy is a device"):
        check_regular_within(tmp_path)


def test_sizes_up_to_the_limit_or_fifty_times_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    check_size("small", DEFAULT_LIMIT_BYTES)
    check_size("large", 50 * 10**9, 10**9)
    with pytest.raises(Sd2Error, match=rf"map\.npz declares 2\.0 GB.*2\.0 MB.*{VARIABLE} to 2\.1"):
        check_size("map.npz", 2 * 10**9, 2 * 10**6)
    monkeypatch.setenv(VARIABLE, "2.1")
    check_size("map.npz", 2 * 10**9, 2 * 10**6)
    assert read_limit_bytes() == 2_100_000_000


@pytest.mark.parametrize("text", ["x", "-1", "0", "nan"])
def test_a_limit_that_is_no_size_is_refused(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(Sd2Error, match=f"{VARIABLE} is '{text}'"):
        read_limit_bytes()


POINTER = (
    "version https://git-lfs.github.com/spec/v1\n"
    "oid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345678\n"
)
PAGE = "\n<!-- served -->\n<!DOCTYPE html>\n<html><head><title>Sign in</title></head></html>"


@pytest.mark.parametrize(
    "name",
    ["a.npz", "a.npy", "a.pkl", "a.mp4", "a.h5", "a.csv", "a.obj", "a.ply", "a.glb", "a.bin",
     "a.zarr.zip", "a.safetensors", "a.sto", "a.sigmf-meta", "recording.json", "a.unheard"],
)  # fmt: skip
@pytest.mark.parametrize(("content", "told"), [(POINTER, "git lfs pull"), (PAGE, "web page")])
def test_what_was_not_fetched_is_named_whatever_it_is_called(
    tmp_path: Path, name: str, content: str, told: str
) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(Sd2Error, match=told):
        kind_of(tmp_path / name)


@pytest.mark.parametrize("content", [POINTER, PAGE])
def test_readers_of_their_own_name_what_was_not_fetched(tmp_path: Path, content: str) -> None:
    def at(name: str) -> Path:
        (tmp_path / name).write_text(content)
        return tmp_path / name

    (tmp_path / "adc_data.bin").write_bytes(bytes(64))
    for read, path in (
        (load_mesh, at("a.obj")),
        (load_mesh, at("a.npz")),
        (load_mesh, at("a.pt")),
        (load_capture, at("a.h5")),
        (load_capture, at("adc_data.cfg").with_suffix(".bin")),
        (lambda path: read_text(path, "labels"), at("labels.eaf")),
        (DopplerMap.load, at("map.npz")),
    ):
        with pytest.raises(Sd2Error, match=r"Git LFS|web page"):
            read(path)


def test_a_store_whose_chunks_were_not_fetched_is_told(tmp_path: Path) -> None:
    store = tmp_path / "a.zarr"
    points, corners = np.zeros((4, 8, 3), np.float32), np.array([[0, 1, 2]])
    save_mesh(MeshSequence(points, corners, Timebase([0.0, 0.1, 0.2, 0.3])), store)
    for chunk in (store / "vertices").rglob("*"):
        if chunk.is_file() and chunk.suffix != ".json":
            chunk.write_text(POINTER)
    with pytest.raises(Sd2Error, match="git lfs pull"):
        load_mesh(store)


def test_a_text_about_web_pages_is_no_web_page(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("tag,meaning\n<html>,a page\n")
    check_regular(tmp_path / "a.csv")
