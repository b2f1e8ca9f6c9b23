"""One row of the table of actions, and when rows are enabled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sd2app.shell.window import MainWindow
    from sd2app.shell.wiring import Context

Handler = Callable[["MainWindow"], None]
Test = Callable[["Context"], bool]


def always(context: Context) -> bool:
    """At any time."""
    return True


def has_content(context: Context) -> bool:
    """Something is open."""
    return context.document.content is not None


def has_mesh(context: Context) -> bool:
    """A mesh is open."""
    return context.document.mesh is not None


def has_spans(context: Context) -> bool:
    """Something is labelled."""
    return bool(context.labels.labels.spans)


def disagree(context: Context) -> bool:
    """Two annotators disagree somewhere."""
    return bool(context.agreement.disagreements)


def has_suggestions(context: Context) -> bool:
    """Something is suggested."""
    return bool(context.suggestions.pending)


def one_selected(context: Context) -> bool:
    """One span is selected."""
    return len(context.labels.selected) == 1


def some_selected(context: Context) -> bool:
    """Spans are selected."""
    return bool(context.labels.selected)


@dataclass(frozen=True)
class Action:
    """One row.

    ``checked`` makes it checkable and says whether it is on; ``why_not`` says in place
    of the tip why it is not enabled. What ``edits_labels`` is not enabled where labels
    cannot be edited, and says that.
    """

    id: str
    menu: str
    text: str
    keys: tuple[str, ...]
    tip: str
    run: Handler
    enabled: Test = always
    checked: Test | None = None
    separator_before: bool = False
    icon: str = ""
    why_not: Callable[[Context], str] | None = None
    edits_labels: bool = False
