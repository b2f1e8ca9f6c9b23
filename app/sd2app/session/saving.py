"""The question whether to save before something is made of what is saved."""

from __future__ import annotations

from sd2app.feature import Shell
from sd2app.session.document import DocumentModel
from sd2app.widgets.dialogs import Answer, confirmed


def saved_first(document: DocumentModel, shell: Shell, made: str) -> bool:
    """True once the open recording, if there is one, is saved; ``made`` says what it is for."""
    recording = document.recording
    if recording is None or not (document.modified or not recording.folder.exists()):
        return True
    words = f"{document.title} has changes that are not saved. {made}"
    return confirmed(shell.dialog_parent, "Save changes?", words, Answer.Save) and shell.save()
