"""Sentences about labels that can be recovered."""

from __future__ import annotations

from sd2app.widgets.text import clock_text
from sd2core.labels.comparison import compare
from sd2core.labels.recovery import Found, Offer
from sd2core.labels.spans import Labels


def edits_text(offer: Offer) -> str:
    """Return the number of edits, and time and name of the last."""
    edits = "1 edit" if offer.edits == 1 else f"{offer.edits:,} edits"
    return f"{edits} until {clock_text(offer.time_unix_s)}, the last “{offer.last}”"


def spans_text(labels: Labels) -> str:
    """Return the number of spans."""
    return "1 span" if len(labels.spans) == 1 else f"{len(labels.spans):,} spans"


def offer_text(offer: Offer, there: Labels) -> str:
    """Describe an offer, compared with the open labels."""
    difference = compare(there, offer.labels)
    return f"{edits_text(offer)}. {spans_text(offer.labels)}; against what is open: {difference}."


def waiting_text(found: Found) -> str:
    """Name the recordings with unsaved labels; empty without any."""
    names = list(dict.fromkeys(one.recording.name for one in found.offers if not one.declined))
    if not names:
        return ""
    listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"The program ended before labels were saved: {listed}."
