"""The card of the model that a run trains: what it learnt from, and how well it does."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sd2core.denoise.card import ModelCard
from sd2core.denoise.files import save_model
from sd2core.denoise.known import KnownMovements
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.model import Denoiser
from sd2core.denoise.registry import options
from sd2core.denoise.scaling import Scaling, whole_map
from sd2core.denoise.texture import Texture
from sd2core.train.config import TrainConfig
from sd2core.train.data import TrainingData
from sd2core.train.validate import Validation

_SHOWS = 0.4
"""Share of the frames in which a cell must show, or it is empty in a denoised map."""
_NAMED = 12
"""No more people are named in a card's words."""


@dataclass(frozen=True, eq=False)
class Facts:
    """Facts of the run that the model file keeps."""

    config: TrainConfig
    data: TrainingData
    scaling: Scaling
    command: str
    machine: dict[str, Any]
    known: KnownMovements | None

    def save(
        self,
        path: Path,
        network: Denoiser,
        found: Validation,
        live: Validation | None,
        epoch: int,
    ) -> None:
        """Write the model with its card; the arguments are those of :meth:`card`."""
        training = network.training
        try:
            save_model(path, TrainedDenoiser(network, self.card(found, live, epoch)))
        finally:
            network.train(training)

    def card(self, found: Validation, live: Validation | None, epoch: int) -> ModelCard:
        """Card of the model of an epoch, with its errors, and those of its network for live frames.

        ``live`` is None where there is no other network for them.
        """
        config, pairs, split = self.config, self.data.pairs, self.data.split
        name = config.model.name
        scaling = self.scaling
        # Here, because only the best epochs need it.
        held_out, axis, known = self.data.validation, pairs.axis, self.known
        answers, radar = found.answers, held_out.targets
        if known is not None:
            maps = held_out.inputs[..., : held_out.inputs.shape[-1] - scaling.more]
            whole = whole_map(maps, axis.bins)
            known = known.trusting(answers, whole, radar, held_out.moving, axis)
            answers = known.mixed(answers, whole, axis)
        counted = [one for one in range(axis.bins) if one not in pairs.null_bins]
        texture = Texture.fitted(answers[..., counted], radar[..., counted])
        if texture is not None:
            floor = max(scaling.floor, texture.mean_that_shows(_SHOWS))
            scaling = replace(scaling, floor=floor)
        return ModelCard(
            model=name,
            options={**options(name), **config.model.options},
            scaling=scaling,
            axis=axis,
            null_bins=pairs.null_bins,
            frame_rate_hz=pairs.frame_rate_hz,
            trained_on=pairs.kind,
            parts=self.data.parts,
            known=known,
            texture=texture,
            about={
                "data": self._data_words(),
                "command": self.command,
                "metrics": {
                    **_errors("validation", found),
                    **({} if live is None else _errors("live_validation", live)),
                    "epoch": epoch,
                },
                "limits": self._limits(),
                "subjects": {
                    "training": list(split.training),
                    "validation": list(split.validation),
                    "test": list(split.test),
                },
                "seed": config.training.seed,
                **({} if config.model.start is None else {"start": config.model.start.name}),
                "machine": self.machine,
                "provenance": pairs.provenance,
            },
        )

    def _data_words(self) -> str:
        pairs, split = self.data.pairs, self.data.split
        names = ", ".join(path.name for path in self.config.data.pairs)
        frames = sum(len(take.times_s) for take in self.data.learnt_takes)
        few = len(split.training) <= _NAMED
        people = f" ({', '.join(split.training)})" if few else ""
        return (
            f"{names}: {len(split.training)} people{people},"
            f" {frames / pairs.frame_rate_hz / 60:.1f} min of {pairs.kind} radar"
            f" at {pairs.frame_rate_hz:g} frames/s"
        )

    def _limits(self) -> str:
        stores = self.data.pairs.provenance.get("mixed", [self.data.pairs.provenance])
        said = [
            f"Knows movements like those of {len(self.data.split.training)} people"
            f"{_named('movements', map(_movements, stores))}"
            f"{_named('before', map(_radar, stores))}."
        ]
        if self.data.pairs.kind == "simulated":
            said.append("Learnt from a simulated radar; nothing is said about a real one.")
        if self.data.split.by_take:
            said.append("Validated on other minutes of the same people, not on other people.")
        return " ".join(said)


def _named(what: str, words: Iterable[str]) -> str:
    """Part of a sentence with all different words; nothing where none is known."""
    known = list(dict.fromkeys(word for word in words if word))
    return f"; {what}: {', '.join(known)}" if known else ""


def _movements(store: Mapping[str, Any]) -> str:
    """Movements in a store of pairs, as far as its provenance says."""
    campaign = store.get("made_by") == "sd2 simulate campaign"
    moves = store.get("protocol", {}).get("movements", "swipes") if campaign else ""
    return {"both": "swipes and recorded motion", "captured": "recorded motion"}.get(moves, moves)


def _radar(store: Mapping[str, Any]) -> str:
    """Radar of a store of pairs, as far as its provenance says."""
    radar = store.get("radar", "")
    name = str(radar.get("name", "")) if isinstance(radar, Mapping) else str(radar)
    drawn = store.get("protocol", {}).get("drawn_radars")
    return f"{name} with surfaces and noise drawn" if name and drawn else name


def _errors(name: str, found: Validation) -> dict[str, float | None]:
    mae_mps = found.mae_mps if math.isfinite(found.mae_mps) else None
    return {f"{name}_rmse": found.rmse, f"{name}_mae_mps": mae_mps}
