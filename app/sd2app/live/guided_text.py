"""What a person in front of camera and radar reads."""

from __future__ import annotations

from sd2app.live.guided import GuidedModel
from sd2core.files.tables import counted

KEYS = "Space: go on    A: again    S: skip    Esc: stop    F11: full screen"
KEYS_AT_END = "Esc: close    F11: full screen"


def headline(model: GuidedModel) -> str:
    """What to do, in few words."""
    step = model.step
    if model.state == "failed":
        return "The session has failed"
    if model.state == "ended":
        return "Thank you" if not model.missing else "Stopped"
    if model.state == "stopping" or step is None:
        return "One moment…"
    if step.phase == "ready":
        return f"{step.person}, please"
    if not step.instruction:
        return "That was the last take"
    return step.instruction


def count_text(model: GuidedModel) -> str:
    """Seconds that are left, where somebody waits for their end."""
    step = model.step
    counts = step is not None and step.phase in ("countdown", "prompt", "pause")
    return "" if not counts or not model.busy or step is None else str(step.left_s)


def detail(model: GuidedModel) -> str:
    """What goes with the headline."""
    step = model.step
    if model.state == "failed":
        return model.text
    if model.state == "ended":
        lacking = f"{counted(len(model.missing), 'take')} missing: {', '.join(model.missing)}"
        return lacking if model.missing else "Nothing is missing."
    if step is None or not model.busy:
        return ""
    match step.phase:
        case "ready":
            return "\n\n".join(filter(None, (" ".join(model.consent.split()), "Space begins.")))
        case "pause" if not step.instruction:
            return "A makes it once more."
        case "pause":
            return "Next. Rest until then."
        case "opening" | "countdown":
            return "Stand still"
        case "prompt":
            return "Now"
    return ""


def progress_text(model: GuidedModel) -> str:
    """Place of the take among all."""
    step = model.step
    return "" if step is None else f"Take {step.number} of {step.takes}"
