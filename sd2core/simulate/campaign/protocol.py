"""Protocols of a campaign: what varies from take to take."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

Order = Literal["to-and-fro", "random"]
"""Swipes of one kind per take, in alternating directions, or of all four kinds."""

Movements = Literal["swipes", "captured", "both"]
"""What people do: swipes and what is between them, what real people were recorded doing, or the
two in turn, take by take."""


@dataclass(frozen=True)
class Protocol:
    """Protocol of a campaign: what varies between takes, and the order of swipes."""

    order: Order = "random"
    place: bool = True  # The person's and the camera's; otherwise the sensor is 2.2 m ahead.
    heading: bool = True  # The person's; otherwise everybody faces the camera.
    others: bool = True  # Hands do other things between swipes, and some takes hold nothing else.
    movements: Movements = "swipes"
    drawn_radars: bool = (
        False  # The radar's looks, surface and noise; otherwise those of all takes.
    )

    @property
    def name(self) -> str:
        """``paper``, ``varied``, or ``between`` the two."""
        swiping = replace(self, movements=VARIED.movements, drawn_radars=VARIED.drawn_radars)
        if swiping == VARIED:
            return "varied"
        return "paper" if replace(self, order=PAPER.order) == PAPER else "between"

    def provenance(self) -> dict[str, Any]:
        """Content for a campaign's provenance; nothing if varied, which all campaigns once were."""
        if self == VARIED:
            return {}
        content = {"name": self.name, **asdict(self)}
        # Campaigns of before there was a choice say nothing of it.
        usual = {"movements": VARIED.movements, "drawn_radars": VARIED.drawn_radars}
        changed = {key: one for key, one in content.items() if one != usual.get(key)}
        return {"protocol": changed}

    def captured(self, number: int) -> bool:
        """True if a take is of recorded motion."""
        return self.movements == "captured" or (self.movements == "both" and number % 2 == 1)


VARIED = Protocol()
"""People anywhere, turned anyhow, who do other things too."""

PAPER = Protocol("to-and-fro", place=False, heading=False, others=False)
"""The paper's experiment: everybody faces a radar and a camera 2.2 m ahead."""
