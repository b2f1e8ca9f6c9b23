"""Metadata of SigMF recordings (``.sigmf-meta``), as far as a radar needs them.

Type of the samples, rate and carrier, after the *Signal Metadata Format Specification* 1.x
(sigmf.org). A few keys of one JSON file: the ``sigmf`` package is not needed for them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.texts import faults_in, read_json

META, DATA = ".sigmf-meta", ".sigmf-data"

_EXPECTED = "the metadata of a SigMF recording"
_KINDS = {"f": "f", "i": "i", "u": "u"}


class SigmfMeta(NamedTuple):
    """Layout of a SigMF recording: a stream of samples."""

    word: np.dtype[np.generic]  # of one real number
    is_complex: bool
    channels: int
    sample_rate_hz: float | None
    carrier_hz: float | None


class _Global(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    datatype: str = Field(alias="core:datatype")
    sample_rate: float | None = Field(default=None, alias="core:sample_rate", gt=0)
    num_channels: int = Field(default=1, alias="core:num_channels", ge=1, le=1024)


class _Capture(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    frequency: float | None = Field(default=None, alias="core:frequency")
    header_bytes: int = Field(default=0, alias="core:header_bytes")


class _Meta(BaseModel):
    global_: _Global = Field(alias="global")
    captures: list[_Capture] = Field(default_factory=list)


def read_sigmf_meta(path: Path) -> SigmfMeta:
    """Read the metadata that belong to a file of either suffix; Sd2Error if they are damaged."""
    path = path.with_suffix(META)
    with faults_in(path, _EXPECTED):
        meta = _Meta.model_validate(read_json(path, _EXPECTED))
    kind = meta.global_.datatype
    match = re.fullmatch(r"([cr])([fiu])(8|16|32|64)(?:_([lb])e)?", kind)
    if match is None or (match[2] == "f" and match[3] in ("8", "16")):
        raise Sd2Error(
            f"{path}: core:datatype is {kind!r:.40}", "a type such as ci16_le or cf32_le"
        )
    if len(meta.captures) > 1 or any(one.header_bytes for one in meta.captures):
        raise Sd2Error(
            f"{path} has {len(meta.captures)} captures, or headers between its samples",
            "one capture, of samples alone",
        )
    order = ">" if match[4] == "b" else "<"
    return SigmfMeta(
        np.dtype(f"{order}{_KINDS[match[2]]}{int(match[3]) // 8}"),
        match[1] == "c",
        meta.global_.num_channels,
        meta.global_.sample_rate,
        meta.captures[0].frequency if meta.captures else None,
    )
