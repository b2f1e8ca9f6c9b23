"""Opening, adding, saving and finding files, and the question before edits are lost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from PySide6.QtWidgets import QMenu, QMessageBox, QPushButton, QWidget

from sd2app.feature import Action, Drop, Feature, Shell, report
from sd2app.fit.model import FitModel
from sd2app.fit.request import read_request
from sd2app.foreign_mesh.model import is_foreign
from sd2app.labels.edits import LabelEdits
from sd2app.session.content import UNTITLED, ReadMesh, recording_of
from sd2app.session.document import DocumentModel
from sd2app.session.session import Session
from sd2app.session.undo import Edits
from sd2app.shell.open_dialog import ask_to_open, keep_reading, kept_reading
from sd2app.widgets.dialogs import Answer, ask_folder, ask_new, confirmed
from sd2app.widgets.notices import Notice
from sd2core.errors import Sd2Error
from sd2core.files.paths import plain_path
from sd2core.files.recording_json import MeshReading
from sd2core.files.resources import resource_path
from sd2core.io.imu_columns import holds_inertial_signals
from sd2core.io.mesh_models import is_estimate
from sd2core.recording.divergence import Divergence
from sd2core.recording.recording import GoneError, Recording, SavedElsewhereError
from sd2core.recording.relinking import Role, role_words

Kept = Literal["mine", "theirs", "merge"]
_SAVED_ELSEWHERE = (
    "{title} was saved by another window or program since it was opened here: {changes}.\n\n"
    "Merge keeps what both changed, and can be undone. Take theirs gives up what is not saved"
    " here; undo brings it back. Keep mine writes over theirs."
)
_PARTS: tuple[Role, ...] = ("video", "mesh", "radar", "imu")
_MOST_IN_MENU = 3


class FilesFeature(Feature):
    """The recording as files; a folder in which a ``fit`` was stopped is taken up.

    ``add_inertial`` adds an inertial sensor's samples, for which nothing else is read again.
    ``see_mesh`` shows a recording's mesh over its video, before it is taken.
    """

    def __init__(
        self,
        session: Session,
        shell: Shell,
        fit: FitModel,
        labels: LabelEdits,
        add_inertial: Callable[[Path], object],
        see_mesh: Callable[[Recording], ReadMesh | None],
    ) -> None:
        self._session, self._shell, self._fit, self._labels = session, shell, fit, labels
        self._add_inertial, self._see_mesh = add_inertial, see_mesh
        self._document = session.document
        self._document.opened.connect(self._remember)
        self._document.changed.connect(self._remember_reading)
        self._document.saved.connect(self._remember)
        report(shell, self._document)
        self.closing = (self._document,)

    def actions(self) -> Sequence[Action]:
        """Open, add, find, save."""
        document, has_content = self._document, self._session.has_content
        return (
            Action(
                "open", "File", "Open…", ("Ctrl+O",),
                "Open a recording (.sd2), a video, a mesh or a radar capture, or several files that"
                " belong together",
                self._ask_open,
            ),
            Action(
                "open_radar", "File", "Open a radar capture…", (),
                "Raw samples, point clouds or maps that a radar has recorded",
                lambda: self._ask_open(radar=True),
            ),
            Action(
                "add", "File", "Add to this recording…", (),
                "Add a video, a mesh, a radar capture or an inertial sensor's samples to what is"
                " open",
                self._ask_add, has_content,
            ),
            Action(
                "relink", "File", "Find missing files…", (),
                "Choose one folder; all missing files are looked for below it", self._relink,
                lambda: document.recording is not None and bool(document.recording.missing()),
            ),
            Action(
                "save", "File", "Save", ("Ctrl+S",),
                "Save labels, sensor and alignment in the recording", self.save, has_content,
            ),
            Action(
                "save_as", "File", "Save as…", ("Ctrl+Shift+S",),
                "Make a recording folder that refers to these files", self.save_as, has_content,
            ),
            Action(
                "sample", "Help", "Open the sample recording", (),
                "A simulated person, four gestures", self.open_sample,
            ),
        )  # fmt: skip

    def notices(self) -> Sequence[Notice]:
        """Offer to read the mesh another way."""
        return (MeshOffer(self._document, self._session.edits),)

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """The latest recordings that were open; the start page lists more."""
        return {"recent": self._add_recent}

    def _add_recent(self, menu: QMenu) -> None:
        recent = QMenu("Open recent", menu)
        recent.aboutToShow.connect(lambda: self._list_recent(recent))
        menu.addMenu(recent)

    def _list_recent(self, menu: QMenu) -> None:
        menu.clear()
        for paths in self._session.settings.recent[:_MOST_IN_MENU]:
            others = "".join(f" + {path.name}" for path in paths[1:])
            action = menu.addAction(f"{paths[0]}{others}".replace("&", "&&"))
            action.triggered.connect(lambda _=False, paths=paths: self.reopen(paths))
        menu.setEnabled(True)
        if menu.isEmpty():
            menu.addAction("Nothing yet").setEnabled(False)

    def _remember(self) -> None:
        if paths := self._document.paths:
            self._session.settings.add_recent(*map(plain_path, paths))

    def _remember_reading(self) -> None:
        """Remember how the mesh of loose files is read; a recording says it itself."""
        recording = self._document.recording
        if recording is not None and recording.folder == UNTITLED and recording.mesh is not None:
            paths = [*map(plain_path, self._document.paths)]
            keep_reading(self._session.settings, paths, recording)

    def reopen(self, paths: Sequence[Path]) -> None:
        """Open what was open lately; its mesh is read as it was then."""
        fields = kept_reading(self._session.settings, paths)
        if fields is None:
            self.replace(paths)
        elif self.may_discard():
            self._document.open(paths, fields)

    def open(self, paths: Sequence[Path]) -> None:
        """Open files in place of what is open, or continue the fit of a folder."""
        if len(paths) == 1 and self._fit.take_up(paths[0]):
            assert self._fit.request is not None
            self._session.settings.add_recent(plain_path(paths[0]))
            paths = [self._fit.request.to_open]
        self._document.open(paths)

    def replace(self, paths: Sequence[Path]) -> None:
        """Open files in place of what is open, a foreign mesh once it was seen over the video."""
        if not self.may_discard():
            return
        mesh = self._foreign(paths, None)
        if mesh is None:
            self.open(paths)
        elif seen := self._see_mesh(mesh):
            self._document.open(paths, seen.fields)

    def open_sample(self) -> None:
        """Open the recording that comes with the program."""
        self.replace([resource_path("swipes.sd2")])

    def _ask_open(self, *, radar: bool = False) -> None:
        if paths := self._ask("Open a radar capture" if radar else "Open", radar=radar):
            if self._document.recording is not None and _is_inertial(paths):
                self._add(paths)  # nothing to look at by itself
            else:
                self.replace(paths)

    def _ask_add(self) -> None:
        if paths := self._ask("Add to this recording"):
            self._add(paths)

    def _add(self, paths: Sequence[Path]) -> None:
        if self._is_growing():
            return
        mesh = self._foreign(paths, self._document.recording)
        if _is_inertial(paths):
            self._add_inertial(paths[0])
        elif mesh is None:
            self._session.edits.add(paths)
        elif seen := self._see_mesh(mesh):
            if len(paths) == 1 and self._document.recording is not None:
                self._session.edits.take_mesh("Take mesh", seen)
            else:
                self._session.edits.add(paths, seen.fields)

    def _is_growing(self) -> bool:
        growing = self._document.growing
        if growing:
            self._shell.warn("A radar is listened to. Stop it first: other files are read anew.")
        return growing

    def _foreign(self, paths: Sequence[Path], base: Recording | None) -> Recording | None:
        """The recording that these files would make, where they bring a foreign mesh to a video."""
        try:
            made = recording_of(paths, None if base is None else replace(base))
        except (Sd2Error, OSError):
            return None  # opening it says why
        if made.folder != UNTITLED and base is None:
            return None  # it says how its mesh is read
        known = None if base is None else base.mesh
        if made.video is None or made.mesh in (None, known) or not is_foreign(made.mesh):
            return None
        # Where an estimator's mesh lies depends on the focal length that it assumed.
        camera = None if is_estimate(made.mesh) else made.camera
        return replace(made, faces=None, mesh_reading=MeshReading(), camera=camera)

    def _ask(self, title: str, *, radar: bool = False) -> list[Path]:
        recent = self._session.settings.recent
        folder = recent[0][0].parent if recent and recent[0][0].parent.is_dir() else None
        return ask_to_open(self._shell.dialog_parent, title, folder, radar=radar)

    def drops_of(self, paths: Sequence[Path]) -> Sequence[Drop]:
        """Ways to use dropped files: in place of what is open, and with it."""
        document, title = self._document, self._document.title
        open_them = Drop(f"Open instead of “{title}”", lambda: self.replace(paths))
        if document.recording is None:
            return (Drop("Open", lambda: self.replace(paths)),)
        if len(paths) == 1 and read_request(paths[0]) is not None:
            return (open_them,)
        try:
            added = recording_of(paths, replace(document.recording))
        except (Sd2Error, OSError):
            return (open_them,)
        before = document.recording
        changed = [one for one in _PARTS if getattr(added, one) != getattr(before, one)]
        replaced = [one for one in changed if getattr(before, one) is not None]
        named = " and the ".join(map(role_words, replaced))
        words = f"Replace the {named} of" if replaced else "Add to"
        add_them = Drop(f"{words} “{title}”", lambda: self._add(paths))
        return (add_them,) if _is_inertial(paths) else (add_them, open_them)

    def _relink(self) -> None:
        """Choose the one folder below which missing files are."""
        if self._is_growing():
            return
        folder = ask_folder(self._shell.dialog_parent, "Find missing files below")
        if folder is None:
            return
        relinked = self._shell.attempt(lambda: self._session.edits.relink(folder))
        if relinked is None:
            return
        for role in relinked.missing:
            self._shell.warn(
                f"No file below {folder} has the name of the missing {role_words(role)}."
            )
        for role, paths in relinked.ambiguous.items():
            names = ", ".join(str(path) for path in paths)
            self._shell.warn(
                f"Several files could be the missing {role_words(role)}: {names}. Nothing was"
                " changed."
            )

    def save(self) -> bool:
        """Save in place, or ask where; ask what is kept where it was saved elsewhere as well."""
        self._session.edits.end_drag()  # what is held, or is being typed, is saved as well
        content = self._document.content
        if content is None:
            return True
        if not content.saved:
            return self.save_as()
        return self._shell.attempt(self._save_here) is True

    def _save_here(self) -> bool:
        try:
            self._document.save()
        except GoneError as error:
            return self._ask_where_else(error)
        except SavedElsewhereError as error:
            return self._ask_what_is_kept(error)
        return True

    def _ask_where_else(self, error: GoneError) -> bool:
        """Offer another folder in place of one that is not there any more."""
        words = f"{error} Nothing is lost: edits are kept for recovery until they are saved."
        if not confirmed(self._shell.dialog_parent, "Save as?", words, Answer.Save):
            return False
        saved = self.save_as()
        if saved and (recording := self._document.recording) is not None and recording.missing():
            parts = " and ".join(recording.missing())
            self._shell.warn(f"The {parts} went with the folder: File → Find missing files…")
        return saved

    def _ask_what_is_kept(self, error: SavedElsewhereError) -> bool:
        """Let the user choose between what is here, what is on disk, and both."""
        recording = self._document.recording
        assert recording is not None
        answer = ask_what_is_kept(self._shell.dialog_parent, self._document.title, error.divergence)
        if answer is None:
            return False
        recording.accept(error.theirs)
        if answer == "theirs":
            self._labels.take_state("Take what was saved elsewhere", error.divergence.theirs)
            self._document.tell_saved()
            return True
        if answer == "merge":
            merged = error.divergence.merged()
            self._labels.take_state("Merge what was saved elsewhere", merged.state)
            if merged.notes:
                self._shell.note(" ".join(merged.notes))
        return self.save()

    def save_as(self) -> bool:
        """Ask for a new recording folder and save there."""
        start = self._document.file_name(".sd2")
        path = ask_new(self._shell.dialog_parent, "Save recording as", start)
        if path is None:
            return False
        return self._shell.attempt(lambda: (self._document.save_as(path), True)) is not None

    def may_discard(self) -> bool:
        """True once unsaved edits are saved or given up by the user's decision."""
        if (typing := self._shell.dialog_parent.focusWidget()) is not None:
            typing.clearFocus()  # which takes what was typed
        if not self._document.modified:
            return True
        buttons = QMessageBox.StandardButton
        answer = QMessageBox.question(
            self._shell.dialog_parent,
            "Save changes?",
            f"{self._document.title} has changes that are not saved.",
            buttons.Save | buttons.Discard | buttons.Cancel,
            buttons.Save,
        )
        if answer == buttons.Save:
            return self.save()
        return answer == buttons.Discard

    may_close = may_discard


class MeshOffer(Notice):
    """Bar on what is unlikely about the mesh, with a button that puts it right."""

    def __init__(self, document: DocumentModel, edits: Edits) -> None:
        tip = "Read the mesh again so; undo takes it back, File → Save keeps it"
        buttons = (("cure", "Read it so", tip, self._accept),)
        super().__init__("Mesh that is unlikely", buttons, document.decline_offers)
        self._document, self._edits = document, edits
        document.offered.connect(self._refresh)

    def _accept(self) -> None:
        document = self._document
        if document.offers:
            read = self._edits.cure_mesh if document.offers_of_open else document.open_mesh_so
            read(document.offers[0].cure)

    def _refresh(self) -> None:
        offers = self._document.offers
        if offers:
            self.buttons["cure"].setText(offers[0].cure.words)
        self.show_words("The mesh is unlikely" if offers else "", offers[0].text if offers else "")


def _is_inertial(paths: Sequence[Path]) -> bool:
    """True for one file of an inertial sensor's samples."""
    return len(paths) == 1 and paths[0].is_file() and holds_inertial_signals(paths[0])


def ask_what_is_kept(parent: QWidget, title: str, divergence: Divergence) -> Kept | None:
    """Ask whose changes are kept; None where the user cancels."""
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setWindowTitle("Saved elsewhere as well")
    box.setText(_SAVED_ELSEWHERE.format(title=title, changes=", ".join(divergence.changes)))
    roles = QMessageBox.ButtonRole
    offered: dict[QPushButton, Kept] = {
        box.addButton("Merge", roles.AcceptRole): "merge",
        box.addButton("Take theirs", roles.DestructiveRole): "theirs",
        box.addButton("Keep mine", roles.DestructiveRole): "mine",
    }
    box.setDefaultButton(next(iter(offered)))
    box.addButton(QMessageBox.StandardButton.Cancel)
    box.exec()
    pressed = box.clickedButton()
    box.deleteLater()
    return next((kept for button, kept in offered.items() if button is pressed), None)
