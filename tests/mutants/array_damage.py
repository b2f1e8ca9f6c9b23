"""Seeded ways to damage what arrays hold, in a file that stays whole otherwise.

Numbers become NaN, negative or huge; an array gets another type, another's content, or another's
place; names are taken away or stand twice; and in descriptions, a value is replaced.
"""

from __future__ import annotations

import io
import json
import pickle
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import joblib
import numpy as np
import zarr
from safetensors.numpy import load, save

_TYPES = ("float16", "float32", "float64", "int8", "int16", "int32", "int64", "uint8", "bool", "U8")
_NUMBERS = (float("nan"), float("inf"), -1, -7.5, 0, 1, 255, 7e8, 2**31, 2**62, 1e300, -(2**62))

Json = Callable[[bytes, random.Random], bytes]
"""How a JSON document is damaged."""


def damages_arrays(path: Path) -> bool:
    """True if :func:`damage_arrays` knows a file or folder."""
    return (path.is_dir() and (path / "zarr.json").exists()) or path.suffix in _KINDS


def damage_arrays(path: Path, rng: random.Random, json_damage: Json) -> str:
    """Damage an array of a file or store; returns how."""
    try:
        damage = _zarr if path.is_dir() else _KINDS[path.suffix]
        return damage(path, rng, json_damage)
    except Exception as error:  # what cannot be written is no mutant
        return f"nothing ({type(error).__name__})"


def _changed(values: np.ndarray, others: list[np.ndarray], rng: random.Random) -> np.ndarray:
    """An array that stands in place of another."""
    way = rng.choice(["number", "number", "number", "type", "other", "shape", "all"])
    if way == "other" and others:
        return rng.choice(others)
    if way == "type":
        with np.errstate(all="ignore"):
            return values.astype(rng.choice(_TYPES))
    if way == "shape":
        return rng.choice(
            [values[:0], values[None], values.reshape(-1), values.T, values[: len(values) // 2]]
        )
    changed = np.array(values)
    value: Any = rng.choice(_NUMBERS)
    if changed.dtype.kind not in "fc":
        value = int(value) if np.isfinite(value) else -1
    if changed.dtype.kind in "iu":
        limits = np.iinfo(changed.dtype)
        value = min(max(value, limits.min), limits.max)
    flat = changed.reshape(-1)
    with np.errstate(all="ignore"):
        if way == "all":
            flat[:] = value
        else:
            flat[rng.randrange(flat.size)] = value
    return changed


def _texts_changed(values: np.ndarray, rng: random.Random, json_damage: Json) -> np.ndarray | None:
    """An array of JSON texts with one of them damaged; None for others."""
    if values.dtype.kind not in "UO" or not values.size:
        return None
    texts = [
        one.decode() if isinstance(one, bytes) else str(one) for one in values.reshape(-1).tolist()
    ]
    at = rng.randrange(len(texts))
    if not texts[at].startswith("{"):
        return None
    texts[at] = json_damage(texts[at].encode(), rng).decode()
    return np.array(texts).reshape(values.shape)


def _npz(path: Path, rng: random.Random, json_damage: Json) -> str:
    with np.load(path, allow_pickle=False) as archive:
        arrays = dict(archive)
    name = rng.choice(list(arrays))
    way = rng.choice(["change", "change", "change", "rename", "lose", "twice"])
    if way == "twice":
        content = io.BytesIO()
        np.save(content, _changed(arrays[name], list(arrays.values()), rng))
        with zipfile.ZipFile(path, "a") as archive:
            archive.writestr(f"{name}.npy", content.getvalue())
        return f"{name} stands twice"
    if way == "change":
        told = _texts_changed(arrays[name], rng, json_damage)
        others = list(arrays.values())
        arrays[name] = _changed(arrays[name], others, rng) if told is None else told
    else:
        values = arrays.pop(name)
        if way == "rename":
            arrays[rng.choice(list(arrays))] = values
    np.savez_compressed(path.open("wb"), **arrays)
    return f"{way} the array {name}"


def _hdf5(path: Path, rng: random.Random, json_damage: Json) -> str:
    with h5py.File(path, "r+") as file:
        names: list[str] = []
        file.visit(
            lambda name: names.append(name) if isinstance(file[name], h5py.Dataset) else None
        )
        name = rng.choice(sorted(names))
        values = np.asarray(file[name][()])
        told = _texts_changed(values, rng, json_damage)
        others = [np.asarray(file[rng.choice(names)][()])]
        del file[name]
        if rng.random() < 0.1:
            return f"lose {name}"
        made = _changed(values, others, rng) if told is None else told
        if made.dtype.kind == "U":
            file.create_dataset(name, data=made.tolist(), dtype=h5py.string_dtype("utf-8"))
        else:
            file.create_dataset(name, data=made)
        return f"change {name}"


def _zarr(path: Path, rng: random.Random, json_damage: Json) -> str:
    group = zarr.open_group(str(path), mode="r+")
    names = sorted(one.parent.name for one in path.glob("*/zarr.json"))
    if not names or rng.random() < 0.3:
        files = [path / "zarr.json", *path.glob("*.jsonl"), *path.glob("*/zarr.json")]
        file = rng.choice(files)
        if file.suffix == ".jsonl":
            lines = file.read_text().splitlines()
            at = rng.randrange(len(lines))
            lines[at] = json_damage(lines[at].encode(), rng).decode()
            file.write_text("\n".join(lines) + "\n")
        else:
            file.write_bytes(json_damage(file.read_bytes(), rng))
        return f"replace a value in {file.relative_to(path)}"
    name, other = rng.choice(names), rng.choice(names)
    made = _changed(np.asarray(group[name][:]), [np.asarray(group[other][:])], rng)
    array: Any = group[name]
    if made.shape == array.shape and made.dtype == array.dtype:
        array[:] = made
    else:
        chunks = tuple(max(1, one) for one in made.shape)
        group.create_array(name, shape=made.shape, dtype=made.dtype, chunks=chunks, overwrite=True)
        group[name][:] = made
    return f"change the array {name}"


def _safetensors(path: Path, rng: random.Random, json_damage: Json) -> str:
    content = path.read_bytes()
    end = 8 + int.from_bytes(content[:8], "little")
    told = json.loads(content[8:end])["__metadata__"]
    tensors = load(content)
    name = rng.choice(sorted(tensors))
    tensors[name] = np.ascontiguousarray(_changed(tensors[name], list(tensors.values()), rng))
    if rng.random() < 0.5:
        told = {**told, "sd2": json_damage(told["sd2"].encode(), rng).decode()}
    path.write_bytes(save(tensors, told))
    return f"change the weights {name}"


def _tree(path: Path, rng: random.Random, _: Json) -> str:
    """Replace or take away a value of a pickle."""
    packed = path.suffix == ".joblib"
    document = joblib.load(path) if packed else pickle.loads(path.read_bytes())
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        for key in list(node) if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list) and len(places) < 10_000:
                walk(node[key])

    walk(document)
    named = [place for place in places if isinstance(place[0], dict)]
    node, key = rng.choice(named if rng.random() < 0.7 else places)
    value = node[key]
    if isinstance(value, np.ndarray) and rng.random() < 0.7:
        node[key] = _changed(value, [value], rng)
    else:
        node[key] = rng.choice([None, "fast", -1, 0, float("nan"), 10**30, [], {}, [[1], [2, 3]],
                                "30", b"x", True, np.zeros(3), np.float32(1e30)])  # fmt: skip
    if packed:
        joblib.dump(document, path)
    else:
        path.write_bytes(pickle.dumps(document))
    return f"replace {key!r}"


_KINDS: dict[str, Callable[[Path, random.Random, Json], str]] = {
    ".npz": _npz,
    ".h5": _hdf5,
    ".safetensors": _safetensors,
    ".pkl": _tree,
    ".joblib": _tree,
}
