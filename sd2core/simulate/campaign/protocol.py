"""Protocols of a campaign: what varies from take to take."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

Order = Literal["to-and-fro", "random"]
"""Swipes of one kind per take, in alternating directions, or of all four kinds."""


@dataclass(frozen=True)
class Protocol:
    """What varies from take to take, and in which order swipes are made."""

    order: Order = "random"
    place: bool = True  # The person's and the camera's; otherwise the sensor is 2.2 m ahead.
    heading: bool = True  # The person's; otherwise everybody faces the camera.
    others: bool = True  # Hands do other things between swipes, and some takes hold nothing else.

    @property
    def name(self) -> str:
        """``paper``, ``varied``, or ``between`` the two."""
        if self == VARIED:
            return "varied"
        return "paper" if replace(self, order=PAPER.order) == PAPER else "between"

    def provenance(self) -> dict[str, Any]:
        """Content for a campaign's provenance; nothing if varied, which all campaigns once were."""
        return {} if self == VARIED else {"protocol": {"name": self.name, **asdict(self)}}


VARIED = Protocol()
"""People anywhere, turned anyhow, who do other things too."""

PAPER = Protocol("to-and-fro", place=False, heading=False, others=False)
"""The paper's experiment: everybody faces a radar and a camera 2.2 m ahead."""
