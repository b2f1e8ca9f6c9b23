from __future__ import annotations

import bz2
import collections
import copyreg
import functools
import gzip
import io
import lzma
import os
import pickle
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE
from sd2core.io.pickles import decompressed, read_pickle

PROTOCOLS = range(pickle.HIGHEST_PROTOCOL + 1)


def plain_data() -> dict[Any, Any]:
    """Everything that a body-estimation tool may store."""
    generator = np.random.default_rng(0)
    content: dict[Any, Any] = collections.defaultdict(dict)
    content[1] = {
        "verts": generator.normal(size=(5, 6, 3)).astype(np.float32),
        "columns_first": np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        "frame_ids": np.arange(5),
        "empty": np.zeros((0, 3)),
        "single": np.float64(2.5),
        "nothing_d": np.array(7, dtype=np.int32),
        "flags": np.array([True, False]),
        "names": np.array(["left", "right"]),
        "list": [1, 2.0, "x", None, True, {3}, frozenset({4}), b"\x00\xff", (1, 2), 1 + 2j],
        "ordered": collections.OrderedDict(b=1, a=2),
    }
    content["again"] = content[1]["verts"]
    return content


def assert_same(expected: Any, found: Any) -> None:
    if isinstance(expected, np.ndarray):
        assert isinstance(found, np.ndarray)
        assert found.dtype == expected.dtype
        np.testing.assert_array_equal(found, expected)
    elif isinstance(expected, dict):
        assert type(found) is type(expected)
        assert list(found) == list(expected)
        for key in expected:
            assert_same(expected[key], found[key])
    else:
        assert type(found) is type(expected)
        assert found == expected


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_pickles_of_plain_data_are_read(tmp_path: Path, protocol: int) -> None:
    path = tmp_path / "data.pkl"
    path.write_bytes(pickle.dumps(plain_data(), protocol))
    assert_same(plain_data(), read_pickle(path))


@pytest.mark.parametrize("protocol", [2, 4, 5])
@pytest.mark.parametrize("compression", [None, "zlib", "gzip", "bz2", "lzma", "xz"])
def test_joblib_files_are_read(tmp_path: Path, compression: str | None, protocol: int) -> None:
    path = tmp_path / "data.pkl"
    joblib.dump(
        plain_data(), path, compress=(compression, 3) if compression else 0, protocol=protocol
    )
    assert_same(plain_data(), read_pickle(path))


def test_names_of_numpy_1_are_read(tmp_path: Path) -> None:
    content = pickle.dumps(np.arange(6.0).reshape(2, 3), 2)
    old = content.replace(b"numpy._core.multiarray", b"numpy.core.multiarray")
    assert old != content
    path = tmp_path / "old.pkl"
    path.write_bytes(old)
    np.testing.assert_array_equal(read_pickle(path), np.arange(6.0).reshape(2, 3))


def test_pickles_of_python_2_are_read(tmp_path: Path) -> None:
    """There an array's bytes are a str of protocol 2."""
    raw = np.arange(3, dtype="<f8").tobytes()
    content = (
        b"\x80\x02cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(K\x00tU\x01btR"
        b"(K\x01(K\x03tcnumpy\ndtype\n(U\x02f8K\x00K\x01tR(K\x03U\x01<NNNJ\xff\xff\xff\xff"
        b"J\xff\xff\xff\xffK\x00tb\x89U" + bytes([len(raw)]) + raw + b"tb."
    )
    path = tmp_path / "python2.pkl"
    path.write_bytes(content)
    np.testing.assert_array_equal(read_pickle(path), np.arange(3.0))


@given(
    array=st.sampled_from(["f4", "f8", "i4", "u1", "c8", "?", "S3", "U2"]).flatmap(
        lambda code: st.tuples(st.just(code), st.lists(st.integers(0, 4), max_size=4))
    ),
    protocol=st.sampled_from(list(PROTOCOLS)),
    fortran=st.booleans(),
)
def test_arrays_of_any_shape_survive(
    tmp_path_factory: pytest.TempPathFactory,
    array: tuple[str, list[int]],
    protocol: int,
    fortran: bool,
) -> None:
    code, shape = array
    values = np.random.default_rng(1).integers(0, 9, size=shape).astype(code)
    values = np.asfortranarray(values) if fortran else values
    folder = tmp_path_factory.mktemp("arrays")
    (folder / "a.pkl").write_bytes(pickle.dumps(values, protocol))
    joblib.dump(values, folder / "b.pkl")
    for name in ("a.pkl", "b.pkl"):
        found = read_pickle(folder / name)
        assert found.dtype == values.dtype
        np.testing.assert_array_equal(found, values)


class Calls:
    """Pickles as a call of anything."""

    def __init__(self, function: Callable[..., Any], *arguments: Any) -> None:
        self.call = (function, arguments)

    def __reduce__(self) -> Any:
        return self.call


def stack_global(module: str, name: str, *arguments: str) -> bytes:
    """A call through STACK_GLOBAL, the way protocol 4 names things."""

    def text(value: str) -> bytes:
        return b"\x8c" + bytes([len(value)]) + value.encode()

    return (
        b"\x80\x04" + text(module) + text(name) + b"\x93("
        + b"".join(text(a) for a in arguments) + b"tR."
    )  # fmt: skip


def hostile_files(mark: Path) -> dict[str, tuple[bytes, str]]:
    """Name, content, and what the error must name; each would create ``mark``."""
    shell = f"touch {mark}"
    code = f"open({str(mark)!r}, 'w').close()"
    joblib_file = io.BytesIO()
    inner = np.array([Calls(os.system, shell)], dtype=object)
    joblib.dump({"verts": inner}, joblib_file)
    wrapped = io.BytesIO()
    joblib.dump([np.zeros(3), Calls(os.system, shell)], wrapped)
    system = f"{os.system.__module__}.system"
    dumps = pickle.dumps
    return {
        "os.system 0": (dumps(Calls(os.system, shell), 0), system),
        "os.system 2": (dumps(Calls(os.system, shell), 2), system),
        "os.system 5": (dumps(Calls(os.system, shell), 5), system),
        "eval": (dumps(Calls(eval, code)), "builtins.eval"),
        "exec": (dumps(Calls(exec, code)), "builtins.exec"),
        "nested": (dumps({"a": [{"verts": (Calls(eval, code),)}]}), "builtins.eval"),
        "partial": (dumps(functools.partial(os.system, shell)), "functools.partial"),
        "reconstructor": (
            dumps(Calls(copyreg._reconstructor, Path, object, None), 2),
            "Path",
        ),
        "getattr": (b"cbuiltins\ngetattr\n(cos\nsystem\nVx\ntR.", "builtins.getattr"),
        "numpy.load": (dumps(Calls(np.load, str(mark))), "load"),
        "runstring": (
            stack_global("numpy.testing._private.utils", "runstring", code), "runstring"),
        "GLOBAL": (b"cos\nsystem\n(V" + shell.encode() + b"\ntR.", "os.system"),
        "INST": (b"(V" + shell.encode() + b"\nios\nsystem\n.", "os.system"),
        "OBJ": (b"(cos\nsystem\nV" + shell.encode() + b"\no.", "os.system"),
        "STACK_GLOBAL": (stack_global("os", "system", shell), "os.system"),
        "dotted": (stack_global("numpy", "dtype.__class__", "x"), "numpy.dtype.__class__"),
        "dotted module": (
            stack_global("collections", "abc.sys.modules", "x"), "collections.abc.sys.modules"),
        "persistent id": (b"\x80\x02U\x05helloQ.", "persistent id"),
        "persistent text": (b"Phello\n.", "persistent id"),
        "extension": (b"\x80\x02\x82\x01.", "extension 1"),
        "object dtype": (dumps(np.array([Calls(os.system, shell)], dtype=object)), system),
        "joblib object dtype": (joblib_file.getvalue(), "object"),
        "joblib after an array": (wrapped.getvalue(), system),
        "out of band": (b"\x80\x05\x97.", "does not need"),
    }  # fmt: skip


HOSTILE = sorted(hostile_files(Path("mark")))


@pytest.mark.parametrize("name", HOSTILE)
def test_nothing_in_a_hostile_file_runs(tmp_path: Path, name: str) -> None:
    mark = tmp_path / "executed"
    content, named = hostile_files(mark)[name]
    path = tmp_path / "hostile.pkl"
    path.write_bytes(content)
    with pytest.raises(Sd2Error) as caught:
        read_pickle(path)
    assert not mark.exists()
    assert named in caught.value.found
    assert str(path) in caught.value.found
    assert "plain NumPy arrays" in caught.value.expected
    assert "numpy.savez" in caught.value.remedy


def test_the_hostile_files_are_hostile(tmp_path: Path) -> None:
    """Read by the standard library, they do what they are refused for."""
    for name in ("os.system 2", "eval", "GLOBAL", "INST", "STACK_GLOBAL", "partial", "OBJ"):
        mark = tmp_path / name.replace(" ", "_")
        result = pickle.loads(hostile_files(mark)[name][0])
        if name == "partial":
            result()
        assert mark.exists(), name


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (b"cbuiltins\nstr\n(C\x01xVzlib_codec\ntR.", "calls 'str'"),
        (b"cbuiltins\nlist\n(cnumpy\nndarray\ntR.", "calls 'list'"),
        (b"cbuiltins\nset\n(Vabc\ntR.", "builds 'set'"),
        (b"cbuiltins\nbytearray\n(J\xff\xff\xff\x7ftR.", "bytearray"),
        (b"cbuiltins\nbytes\n(J\xff\xff\xff\x7ftR.", "bytes"),
        (b"cbuiltins\nlist\n)\x81.", "makes 'list'"),
        (b"cbuiltins\ndict\n}(Vx\nK\x01ub.", "sets the state of 'dict'"),
        (b"c_codecs\nencode\n(Vx\nVrot13\ntR.", "stores bytes"),
        (b"ccollections\ndefaultdict\n(c_codecs\nencode\ntR.", "factory"),
        (b"cnumpy\ndtype\n(VS0\ntR.", "dtype S0"),
        (b"cnumpy\ndtype\n(K\x01tR.", "given as int"),
        (
            b"cnumpy._core.multiarray\n_reconstruct\n(NNNtRq\x00"
            + 2 * b"h\x00(K\x01(K\x03tcnumpy\ndtype\n(Vu1\ntR\x89C\x03abctb"
            + b".",
            "form that is not known",
        ),
        (b"ccopyreg\n_reconstructor\n(cbuiltins\nlist\ncbuiltins\nobject\nNtR.", "makes an object"),
        (b"cnumpy\ndtype\n(Vf8,f8\ntR.", "dtype f8,f8"),
        (b"cnumpy\ndtype\n(VV8\ntR(K\x03V|\nN(Va\nt}NNNtb.", "dtype V8"),
    ],
)
def test_allowed_names_do_no_more_than_they_must(
    tmp_path: Path, content: bytes, named: str
) -> None:
    path = tmp_path / "odd.pkl"
    path.write_bytes(b"\x80\x03" + content)
    with pytest.raises(Sd2Error) as caught:
        read_pickle(path)
    assert named in caught.value.found


def test_a_zip_is_no_pickle(tmp_path: Path) -> None:
    path = tmp_path / "tensor.pkl"
    path.write_bytes(b"PK\x03\x04" + bytes(60))
    with pytest.raises(Sd2Error, match=r"tensor\.pkl is a zip archive.*\.pt"):
        read_pickle(path)


def joblib_claiming(shape: tuple[int, ...]) -> bytes:
    buffer = io.BytesIO()
    joblib.dump(np.zeros((7, 5)), buffer)
    claimed = b"(" + b"".join(b"\x8a\x08" + struct.pack("<q", n) for n in shape) + b"t"
    # The frame's length no longer fits; without frames the stream reads the same.
    content = buffer.getvalue().replace(b"K\x07K\x05\x86", claimed)
    return content[:2] + content[11:]


def test_a_false_size_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    path = tmp_path / "bomb.pkl"
    path.write_bytes(joblib_claiming((2**20, 2**20)))
    with pytest.raises(Sd2Error, match=r"claims an array of shape \(1048576, 1048576\), 8,192"):
        read_pickle(path)
    path.write_bytes(joblib_claiming((8, 5)))
    with pytest.raises(Sd2Error, match="ends inside an array"):
        read_pickle(path)
    path.write_bytes(joblib_claiming((-1, 5)))
    with pytest.raises(Sd2Error, match="impossible shape"):
        read_pickle(path)


@pytest.mark.parametrize("compression", ["zlib", "gzip", "xz"])
def test_a_compressed_bomb_is_refused(tmp_path: Path, compression: str) -> None:
    path = tmp_path / "bomb.pkl"
    joblib.dump({"a": np.zeros(2**18), "b": b"0" * 2**20}, path, compress=(compression, 9))
    assert path.stat().st_size < 2**17
    with pytest.raises(Sd2Error, match=r"bomb\.pkl claims"):
        read_pickle(path, limit_bytes=2**20)
    assert read_pickle(path, limit_bytes=2**22)["a"].shape == (2**18,)


@pytest.mark.parametrize("content", [b"", b"hello", b"\x80\x04", bytes(range(256))])
def test_what_is_no_pickle_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "wrong.pkl"
    path.write_bytes(content)
    with pytest.raises(Sd2Error, match=r"wrong\.pkl"):
        read_pickle(path)


@pytest.mark.parametrize("compression", [0, ("zlib", 3), ("gzip", 3), ("bz2", 3), ("xz", 3)])
def test_a_file_cut_short_is_named(tmp_path: Path, compression: Any) -> None:
    path = tmp_path / "cut.pkl"
    joblib.dump(plain_data(), path, compress=compression)
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(Sd2Error, match=r"cut\.pkl cannot be read as a pickle"):
        read_pickle(path)


@given(st.binary(max_size=200), st.integers(0, 400))
def test_damage_gives_a_sentence_or_data(
    tmp_path_factory: pytest.TempPathFactory, noise: bytes, place: int
) -> None:
    content = bytearray(pickle.dumps(plain_data(), 4))
    content[place : place + len(noise)] = noise
    path = tmp_path_factory.mktemp("noise") / "noise.pkl"
    path.write_bytes(content)
    try:
        read_pickle(path)
        message = None
    except Sd2Error as error:
        message = str(error)
    assert message is None or "noise.pkl" in message


@pytest.mark.parametrize(
    "compress",
    [zlib.compress, gzip.compress, bz2.compress, lzma.compress, bytes],
    ids=["zlib", "gzip", "bz2", "xz", "none"],
)
@given(content=st.binary(min_size=1, max_size=3000))
@settings(max_examples=20)
def test_compressions_are_recognised(compress: Callable[[bytes], bytes], content: bytes) -> None:
    content = b"\x80\x04" + content
    assert decompressed(io.BytesIO(compress(content))).read(10_000) == content


LIMIT = 2**20


def frame(instructions: bytes) -> bytes:
    return b"\x95" + struct.pack("<Q", len(instructions)) + instructions


def kept(content: bytes) -> bytes:
    """Instructions that put bytes into the memo's first place."""
    return b"B" + struct.pack("<I", len(content)) + content + b"q\x00"


COPIED = b"c__builtin__\nbytearray\nh\x00\x85R0"
"""Instructions that make a copy of the memo's first object, and drop it."""


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\x80\x04" + b"\x8f" * 20_000 + b".", "more single objects"),
        (b"\x80\x04" + frame(b"]" * 20_000) + b".", "more single objects"),
        (b"\x80\x03" + kept(bytes(10**5)) + COPIED * 20 + b".", "makes more of its content"),
    ],
)  # fmt: skip
def test_a_small_file_does_not_become_many_objects(
    tmp_path: Path, content: bytes, words: str
) -> None:
    path = tmp_path / "bomb.pkl"
    path.write_bytes(content)
    with pytest.raises(Sd2Error, match=rf"bomb\.pkl .*{words}.*{VARIABLE}"):
        read_pickle(path, limit_bytes=LIMIT)


def test_one_array_is_not_filled_again_and_again(tmp_path: Path) -> None:
    path = tmp_path / "again.pkl"
    content = pickle.dumps(np.arange(10_000.0), 2)
    path.write_bytes(content[:-1] + b"0" + (content[2:-1] + b"0") * 20 + b"N.")
    with pytest.raises(Sd2Error, match=r"again\.pkl "):
        read_pickle(path, limit_bytes=LIMIT)
    assert read_pickle(path, limit_bytes=2**23) is None


def test_the_limit_goes_by_the_size_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "zeros.pkl"
    joblib.dump({"a": np.zeros(2**18)}, path, compress=9)
    monkeypatch.setenv(VARIABLE, "0.001")
    with pytest.raises(Sd2Error, match=rf"zeros\.pkl claims .*{VARIABLE}"):
        read_pickle(path)
    monkeypatch.setenv(VARIABLE, "0.01")
    assert read_pickle(path)["a"].shape == (2**18,)


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.pkl")
    with pytest.raises(Sd2Error, match=r"pipe\.pkl is a named pipe"):
        read_pickle(tmp_path / "pipe.pkl")
