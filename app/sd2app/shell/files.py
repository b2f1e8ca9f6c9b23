"""Opening, adding, saving and finding files, and the question before edits are lost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QMenu, QMessageBox

from sd2app.feature import Action, Feature, Shell
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_folder, ask_new
from sd2core.files.resources import resource_path

_FILES = (
    "Video, mesh, radar (*.mp4 *.mkv *.mov *.avi *.webm *.npz *.zip *.obj *.ply *.glb *.pkl *.npy"
    " recording.json);;All files (*)"
)


class FilesFeature(Feature):
    """The recording as files."""

    def __init__(self, session: Session, shell: Shell) -> None:
        self._session, self._shell = session, shell
        self._document = session.document
        self._document.failed.connect(shell.warn)
        self._document.noted.connect(shell.note)
        self.changing = (self._document.changed,)
        self.closing = (self._document,)

    def actions(self) -> Sequence[Action]:
        """Open, add, find, save."""
        document, has_content = self._document, self._session.has_content
        return (
            Action(
                "open", "File", "Open…", ("Ctrl+O",),
                "Open a video, mesh or radar capture, or several that belong together",
                self._open_files,
            ),
            Action(
                "open_folder", "File", "Open folder…", ("Ctrl+Shift+O",),
                "Open a recording (.sd2), a radar capture or a folder of meshes",
                self._open_folder,
            ),
            Action(
                "add", "File", "Add to this recording…", (),
                "Add a video, mesh or radar capture to what is open", self._add_files, has_content,
            ),
            Action(
                "add_folder", "File", "Add folder to this recording…", (),
                "Add a radar capture or a folder of meshes to what is open",
                self._add_folder, has_content,
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

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """Recordings that were open lately."""
        return {"recent": self._add_recent}

    def _add_recent(self, menu: QMenu) -> None:
        recent = QMenu("Open recent", menu)
        recent.aboutToShow.connect(lambda: self._list_recent(recent))
        menu.addMenu(recent)

    def _list_recent(self, menu: QMenu) -> None:
        menu.clear()
        for path in self._session.settings.recent:
            action = menu.addAction(str(path))
            action.triggered.connect(lambda _=False, path=path: self._open([path]))
        menu.setEnabled(True)
        if menu.isEmpty():
            menu.addAction("Nothing yet").setEnabled(False)

    def _open(self, paths: Sequence[Path]) -> None:
        if self.may_discard():
            self._shell.open_paths(paths)

    def open_sample(self) -> None:
        """Open the recording that comes with the program."""
        self._open([resource_path("swipes.sd2")])

    def _open_files(self) -> None:
        if (paths := self._ask_files("Open")) and self.may_discard():
            self._document.open(paths)

    def _open_folder(self) -> None:
        if (folder := self._ask_folder("Open folder")) and self.may_discard():
            self._document.open([folder])

    def _add_files(self) -> None:
        if paths := self._ask_files("Add to this recording"):
            self._document.add(paths)

    def _add_folder(self) -> None:
        if folder := self._ask_folder("Add folder to this recording"):
            self._document.add([folder])

    def _relink(self) -> None:
        """Choose the one folder below which missing files are."""
        folder = self._ask_folder("Find missing files below")
        if folder is None:
            return
        relinked = self._shell.attempt(lambda: self._document.relink(folder))
        if relinked is None:
            return
        for role in relinked.missing:
            self._shell.warn(f"No file below {folder} has the name of the missing {role}.")
        for role, paths in relinked.ambiguous.items():
            names = ", ".join(str(path) for path in paths)
            self._shell.warn(
                f"Several files could be the missing {role}: {names}. Nothing was changed."
            )

    def save(self) -> bool:
        """Save in place, or ask where."""
        content = self._document.content
        if content is None:
            return True
        if not content.saved:
            return self.save_as()
        return self._shell.attempt(lambda: (self._document.save(), True)) is not None

    def save_as(self) -> bool:
        """Ask for a new recording folder and save there."""
        start = f"{self._document.title}.sd2"
        path = ask_new(self._shell.dialog_parent, "Save recording as", start)
        if path is None:
            return False
        return self._shell.attempt(lambda: (self._document.save_as(path), True)) is not None

    def may_discard(self) -> bool:
        """True once unsaved edits are saved or given up by the user's decision."""
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

    def may_close(self) -> bool:
        """Ask what becomes of unsaved edits."""
        return self.may_discard()

    def _ask_files(self, title: str) -> list[Path]:
        names, _ = QFileDialog.getOpenFileNames(self._shell.dialog_parent, title, "", _FILES)
        return [Path(name) for name in names]

    def _ask_folder(self, title: str) -> Path | None:
        return ask_folder(self._shell.dialog_parent, title)
