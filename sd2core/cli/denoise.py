"""``sd2 denoise``: synthetic Doppler to what a radar would show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sd2core.cli.command_parser import command
from sd2core.cli.output import Report, progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.records import ARGUMENT
from sd2core.options.shared import Denoising, Json, MapOutput


class Denoise(MapOutput, Denoising, Json):
    """Options of ``sd2 denoise``.

    Parameters
    ----------
    map : MAP
        a map from `sd2 synth`
    """

    map: Annotated[Path, ARGUMENT]


@command("denoise", Denoise)
def _denoise(options: Denoise) -> Report:
    """Turn a synthetic Doppler map into what a radar would show.

    A trained model estimates what a radar would have measured, from the map that
    `sd2 synth` counted. The map must be made as those that the model learnt from (same
    bins, same emptied bins); `sd2 info MODEL` says how. Another frame rate is brought
    to the model's and back. Frames without a person stay empty.

      sd2 denoise map.npz --out denoised.npz
      sd2 denoise map.npz --out denoised.npz --model runs/first/best.safetensors
      sd2 denoise map.npz --out as-the-radar-shows-it.npz --texture
    """
    from sd2core.cli.info.description import describe_map
    from sd2core.cli.info.model import model_words
    from sd2core.denoise.files import default_name, describe_model, find_model, load_model
    from sd2core.denoise.resample_to_model import check_map
    from sd2core.files.texts import errors_in
    from sd2core.io.kinds import kind_of
    from sd2core.maps import DopplerMap

    kind = kind_of(options.map)
    if kind != "map":
        makes_one = f"Make one: `sd2 synth {options.map} --out map.npz`"
        raise Sd2Error(
            f"{options.map} holds no Doppler map; it is of kind {kind}",
            "a map from `sd2 synth`",
            makes_one if kind in ("mesh", "recording") else "",
        )
    doppler = DopplerMap.load(options.map)
    limbs = doppler.limbs is not None and doppler.limbs.of_everybody
    path = find_model(options.model or default_name(limbs=limbs))
    # Before torch is loaded, which takes seconds.
    card = describe_model(path)
    with errors_in(options.map):
        check_map(doppler, card)
    texture = None if options.texture is None else card.needed_texture()
    with progress_bar("Denoising") as progress:
        denoised = load_model(path).denoise(doppler, progress)
    if texture is not None and options.texture is not None:
        denoised = texture.on(denoised, options.texture)
    denoised.save(options.out)
    description = describe_map(options.out, denoised)
    description.facts = {"model": model_words(card)} | description.facts
    return description
