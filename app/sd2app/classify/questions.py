"""Actions of the panel of classifiers that need dialogs."""

from __future__ import annotations

from typing import Protocol


class ClassAsks(Protocol):
    """Each may ask first, or be refused."""

    def add_folder(self) -> None:
        """Let the user choose a folder with labelled data."""

    def add_file(self) -> None:
        """Let the user choose a data set or a labelled radar file."""

    def add_this(self) -> None:
        """Learn from the recording that is open."""

    def has_this(self) -> bool:
        """True if the open recording can be learnt from: it is on disk."""

    def train(self) -> None:
        """Start the training."""

    def compare(self) -> None:
        """Start the comparison."""

    def again(self) -> None:
        """Resume the comparison in view."""

    def copy_command(self) -> None:
        """Put the command on the clipboard."""

    def use_model(self) -> None:
        """Use the model of the run in view."""

    def show_result(self) -> None:
        """Show the result of the comparison in view."""

    def open_result(self) -> None:
        """Let the user choose a result, and show it."""

    def delete(self) -> None:
        """Ask, then delete the run in view."""
