"""What is opened is a regular file, and what it declares is no more than it can hold."""

from __future__ import annotations

import os
from pathlib import Path

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
from sd2core.io.kinds import kind_of


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
