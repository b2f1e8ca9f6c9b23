"""What a person in front of camera and radar reads."""

from __future__ import annotations

from sd2app.live.guided import GuidedModel
from sd2core.files.tables import counted

KEYS_OF_CONSENT = "Y: I agree    N: I do not agree    ↑ ↓: read on    Esc: stop    F11: full screen"
KEYS = "Space: go on    A: again    S: skip    Esc: stop    F11: full screen"
KEYS_AT_END = "Esc: close    F11: full screen"


def keys_text(model: GuidedModel) -> str:
    """Keys that do something now."""
    if not model.busy:
        return KEYS_AT_END
    return KEYS_OF_CONSENT if asks_consent(model) else KEYS


def asks_consent(model: GuidedModel) -> bool:
    """True while a person is to read what they agree to."""
    return model.state == "running" and model.step is not None and model.step.phase == "consent"


def headline(model: GuidedModel) -> str:
    """What to do, in few words."""
    step = model.step
    if model.state == "failed":
        return "The session has failed"
    if model.state == "stopped":
        return "Thank you" if not model.missing else "Stopped"
    if model.state == "stopping" or step is None:
        return "One moment…"
    if step.phase == "consent":
        return f"{step.person}, do you agree?"
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
    if model.state == "stopped":
        if not model.missing:
            return "Nothing is missing."
        lacking = f"{counted(len(model.missing), 'take')} missing: {', '.join(model.missing)}"
        without = f"Not agreed: {', '.join(model.not_agreed)}" if model.not_agreed else ""
        return "\n".join(filter(None, (lacking, without)))
    if step is None or not model.busy:
        return ""
    match step.phase:
        case "ready":
            return "Space begins."
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
