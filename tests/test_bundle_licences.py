"""What a bundle carries is named with its licence, and what may not be passed on is refused."""

from __future__ import annotations

import functools
import importlib.util
import os
import re
import sys
import sysconfig
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.environments import REPOSITORY

_spec = importlib.util.spec_from_file_location(
    "bundle_licences", REPOSITORY / "app" / "packaging" / "licences.py"
)
assert _spec is not None
assert _spec.loader is not None
licences = importlib.util.module_from_spec(_spec)
sys.modules["bundle_licences"] = licences  # dataclasses look their module up
_spec.loader.exec_module(licences)

SITE = Path(sysconfig.get_path("platlib"))
OURS = licences.Component("SD² Studio", "1", "Apache-2.0", "here")
LIBRARY = re.compile(r"\.(so|dylib|dll|pyd)\b")
on_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks at ELF files")


def part(licence: str, name: str = "thing", text: str = ""):
    return licences.Component(name, "1.0", licence, "https://example.org", text)


@functools.cache
def installed() -> list[tuple[str, str]]:
    """Every shared library of the environment, more than the recipe carries."""
    walked = ((at, name) for at, _, names in os.walk(SITE) for name in names)
    paths = sorted(Path(at, name) for at, name in walked if LIBRARY.search(name))
    return [(path.relative_to(SITE).as_posix(), str(path)) for path in paths]


@functools.cache
def found():
    return licences.components(carried(), OURS)


def carried() -> list[tuple[str, str]]:
    """What the recipe carries: neither tools of developers nor all of Qt."""
    left_out = (
        "debugpy",
        "embreex",
        "mypy",
        "zmq",
        "pyzmq",
        "sqlalchemy",
        "ruff",
        "PySide6/Qt/qml",
    )
    return [
        one for one in installed() if not one[0].startswith(left_out) and "__mypyc" not in one[0]
    ]


def libraries_named(word: str) -> set[str]:
    parts = [one for one in found() if one.name == word]
    return set().union(*(found()[one] for one in parts))


@pytest.mark.slow
def test_every_library_of_the_environment_is_named_with_its_licence() -> None:
    named = set().union(*found().values())
    assert {licences.place(path) for _, path in carried()} <= named
    assert len(named) > 500
    licences.judge(found())


@pytest.mark.slow
@on_linux
def test_libraries_in_packages_have_their_own_licence() -> None:
    named = {
        (one.name, one.version.split()[1]): one.licence for one in found() if "in " in one.version
    }
    assert named["x264", "av"] == "GPL-2.0-or-later"
    assert named["FFmpeg", "av"] == "LGPL-3.0-or-later"
    assert named["FFmpeg", "opencv-contrib-python-headless"] == "LGPL-2.1-or-later"
    assert named["Qt 6", "PySide6_Essentials"] == "LGPL-3.0-only"
    assert named["libquadmath", "scipy"] == "LGPL-2.1-or-later"
    # In a library of another name, as bytes of both say.
    assert named["FFTW", "finufft"] == "GPL-2.0-or-later"


def test_a_file_of_nothing_known_is_refused_by_name(tmp_path: Path) -> None:
    stray = tmp_path / "libstray.so.1"
    stray.write_bytes(b"\x7fELF")
    with pytest.raises(licences.Refused, match=r"libstray\.so\.1.*not known.*add a row"):
        licences.components([("libstray.so.1", str(stray))], OURS)


def test_an_empty_file_holds_no_library(tmp_path: Path) -> None:
    (tmp_path / "py.typed").touch()
    assert licences.native("cv2/py.typed", str(tmp_path / "py.typed")) == []


def test_an_ffmpeg_that_may_not_be_passed_on_is_refused(tmp_path: Path) -> None:
    library = tmp_path / "libavcodec-0.so.62"
    library.write_bytes(b"libavcodec license: nonfree and unredistributable\0")
    parts = licences.components([(library.name, str(library))], OURS)
    with pytest.raises(licences.Refused, match=r"FFmpeg .*nonfree"):
        licences.judge(parts)


@pytest.mark.parametrize("name", ["libcudart.so.12", "libcublas.so.12", "libmkl_core.so.2"])
def test_libraries_of_cuda_and_mkl_are_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"\x7fELF")
    parts = licences.components([(name, str(tmp_path / name))], OURS)
    with pytest.raises(licences.Refused, match=r"NVIDIA|MKL"):
        licences.judge(parts)


@pytest.mark.parametrize(
    "licence",
    [
        "CC-BY-NC-4.0",
        "GPL-2.0-only",
        "GNU General Public License v2",
        "LicenseRef-NVIDIA-Proprietary",
        "MIT AND GPL-2.0-only",
        "MIT AND (GPL-2.0-only OR SSPL-1.0)",
        "Other/Proprietary License",
        "no licence named",
    ],
)
def test_what_may_not_be_passed_on_is_refused_by_name(licence: str) -> None:
    with pytest.raises(licences.Refused) as told:
        licences.judge([part("MIT"), part(licence, "culprit")])
    assert "culprit" in str(told.value)
    assert f"“{licence}”" in str(told.value)


expressions = st.recursive(
    st.sampled_from(["MIT", "GPL-2.0-only", "Apache-2.0", "CC-BY-NC-4.0", "OpenSSL"]),
    lambda inner: st.tuples(inner, st.sampled_from(["AND", "OR"]), inner),
    max_leaves=8,
)


@given(expressions, st.frozensets(st.sampled_from(["MIT", "GPL-2.0-only", "OpenSSL"])))
def test_expressions_are_met_as_their_words_say(expression, among: frozenset[str]) -> None:
    def written(one) -> str:
        return one if isinstance(one, str) else f"({written(one[0])} {one[1]} {written(one[2])})"

    def met(one) -> bool:
        if isinstance(one, str):
            return one in among
        return (all if one[1] == "AND" else any)((met(one[0]), met(one[2])))

    assert licences.allowed(written(expression), among) == met(expression)


def test_parts_under_the_gpl_are_told_from_those_that_may_be() -> None:
    only, either = part("GPL-3.0-or-later"), part("LGPL-3.0-only OR GPL-2.0-only", "either")
    assert licences.judge([part("MIT"), either, only]) == [only]


@pytest.mark.parametrize("licence", sorted(licences.APART - {"AFL-2.1"}))
def test_what_is_linked_to_the_gpl_and_what_it_forbids_is_refused(licence: str) -> None:
    parts = {part("GPL-2.0-or-later", "x264"): {"/x"}, part(licence, "other"): {"/o"}}
    links = {"/both": {"/middle", "/x"}, "/middle": {"/o"}, "/one": {"/x"}}
    imports = lambda path: links.get(path, set())  # noqa: E731
    users = licences.keep_apart(parts, ["/one", "/middle"], imports)
    assert [sorted(who) for who in users.values()] == [["one"], ["middle"]]
    with pytest.raises(licences.Refused, match=r"/both is linked to x264 .* and other"):
        licences.keep_apart(parts, ["/one", "/both"], imports)


@pytest.mark.slow
@on_linux
def test_only_opencv_uses_the_old_openssl_and_only_pyav_x264() -> None:
    pytest.importorskip("PyInstaller")
    near = ("av", "cv2", "opencv", "finufft", "torch/lib")
    binaries = [path for name, path in carried() if name.startswith(near)]
    users = {one.name: who for one, who in licences.keep_apart(found(), binaries).items()}
    assert users["OpenSSL 1.1"] == {"opencv-contrib-python-headless"}
    assert users["x264"] == users["x265"] == {"av"}
    assert libraries_named("OpenSSL 1.1")


@pytest.mark.slow
@on_linux
def test_the_texts_are_found_each_once() -> None:
    texts = licences.texts(found())
    titles = [title for several in texts.values() for title in several]
    assert any(title.startswith("numpy") for title in titles)
    for words in licences.GNU.values():
        assert any(all(one in " ".join(text.split()) for one in words) for text in texts)


def test_a_text_that_is_nowhere_is_refused_and_a_notice_named(tmp_path: Path) -> None:
    (tmp_path / "GPL-3").write_text("the text")
    with pytest.raises(licences.Refused, match=r"text of LGPL-3\.0 .* nowhere"):
        licences.texts({part("LGPL-3.0-only"): {"/x"}}, tmp_path)
    named = licences.texts({part("MIT", text="© Somebody"): {"/x"}}, tmp_path)
    (added,) = [text for text, titles in named.items() if titles == ["NOTICES TO ADD"]]
    assert "- thing (" in added


@pytest.mark.slow
@on_linux
def test_the_file_names_parts_and_addresses(tmp_path: Path, capsys) -> None:
    pytest.importorskip("PyInstaller")
    near = [path for name, path in carried() if name.startswith("av.libs")]
    file = licences.write(tmp_path / "LICENCES.txt", carried(), near, "1")
    head, rest = file.read_text("utf-8").split("COMPONENTS")
    assert "x264 (in av" in head
    assert "Qt 6 (in PySide6" in rest
    assert "code.videolan.org/videolan/x264" in rest
    assert re.fullmatch(r"LICENCES.txt names \d+ components\n", capsys.readouterr().out)
