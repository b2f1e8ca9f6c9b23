"""``sd2 classify``: find gestures in Doppler maps."""

from __future__ import annotations

from sd2core.cli.command_parser import Subcommands, add_declared, command_group


@command_group("classify")
def _commands(kinds: Subcommands) -> None:
    """Train, evaluate and apply gesture classifiers.

    A classifier gives the probability of each gesture in every frame of a Doppler map.
    It is trained on labelled maps and evaluated on people it was not trained on.

      sd2 classify train campaign.zarr --out gestures.safetensors
      sd2 classify apply walk.sd2
    """
    modules = {"train": "train", "eval": "trained", "apply": "trained", "table": "comparison"}
    add_declared(kinds, {name: f"classify.{module}" for name, module in modules.items()})
