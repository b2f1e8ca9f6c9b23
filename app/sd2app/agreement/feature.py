"""Agreement of two annotators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from sd2app.agreement.model import AgreementModel
from sd2app.agreement.panel import AgreementPanel, OtherTimeline
from sd2app.feature import Action, Feature, Shell
from sd2app.labels.import_dialog import label_files
from sd2app.labels.model import LabelsModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file


class AgreementFeature(Feature):
    """Another person's labels below these, and how far the two agree."""

    def __init__(
        self, session: Session, shell: Shell, labels: LabelsModel, parent: QObject
    ) -> None:
        self._session, self._shell = session, shell
        self.model = AgreementModel(session, labels, parent)
        self.changing = (self.model.changed,)
        self.closing = (self.model,)
        self.model.failed.connect(shell.warn)

    def actions(self) -> Sequence[Action]:
        """Comparison of labels."""
        model = self.model
        return (
            Action(
                "show_agree", "View", "Agreement panel", ("Shift+A",),
                "How far another person's labels agree with these",
                lambda: self._shell.bring_up("Agreement"),
            ),
            Action(
                "compare_labels", "Labels", "Compare with another's labels…", ("Ctrl+Shift+K",),
                "Show how far another person's labels agree with these, and where they do not",
                self._compare, self._session.has_content,
            ),
            Action(
                "next_disagreement", "Labels", "Next disagreement", ("Shift+N",),
                "Go to where the labels differ next", lambda: model.step(1), self._disagree,
            ),
            Action(
                "previous_disagreement", "Labels", "Previous disagreement", ("Shift+P",),
                "Go to where the labels differ before", lambda: model.step(-1), self._disagree,
            ),
            Action(
                "end_comparison", "Labels", "End the comparison of labels", (),
                "Take the other's labels away", model.clear, lambda: model.active,
            ),
        )  # fmt: skip

    def _disagree(self) -> bool:
        return bool(self.model.disagreements)

    def _compare(self) -> None:
        parent = self._shell.dialog_parent
        if path := ask_file(parent, "Compare with another's labels", label_files()):
            self.model.open(path)
            self._shell.bring_up("Agreement")

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side, and the other person's labels below these."""
        s = self._session
        return {
            "Agreement": AgreementPanel(self.model, s.playback, self._shell.action),
            "other labels": OtherTimeline(s, self.model),
        }

    def attach(self) -> None:
        """Compare anew, or forget the comparison of the recording before."""
        if self._session.document.same_recording and self.model.path is not None:
            self.model.open(self.model.path)
        else:
            self.model.clear()
