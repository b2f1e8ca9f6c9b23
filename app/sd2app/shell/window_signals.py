"""Which signals of the models the window itself follows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import SignalInstance

if TYPE_CHECKING:
    from sd2app.shell.wiring import Context
    from sd2app.widgets.message_bar import MessageBar


def connect_sentences(context: Context, messages: MessageBar) -> None:
    """Show the user what models have to say."""
    c = context
    for model in (
        c.document,
        c.synthesis,
        c.trade,
        c.placements,
        c.uncertainty,
        c.denoise,
        c.classify,
        c.video,
        c.label_session,
        c.label_edits,
        c.training,
        c.training_use,
        c.batch,
        c.export,
        c.class_training,
    ):
        model.failed.connect(messages.warn)
    for model in (
        c.document,
        c.fit_taker,
        c.denoise,
        c.trade,
        c.label_session,
        c.training,
        c.training_use,
        c.batch,
        c.export,
        c.class_training,
    ):
        model.noted.connect(messages.note)


def signals_of_actions(context: Context) -> tuple[SignalInstance, ...]:
    """After which an action may be possible that was not, or the other way round."""
    c = context
    return (
        c.document.changed,
        c.document.undo_stack.indexChanged,
        c.document.undo_stack.cleanChanged,
        c.playback.playing_changed,
        c.playback.loop_changed,
        c.display.mesh_changed,
        c.overlay.changed,
        c.uncertainty.changed,
        c.denoise.changed,
        c.live.changed,
        c.classify.changed,
        c.difference.state_changed,
        c.fit.state_changed,
        c.synthesis.completed,
        c.trade.plan_changed,
        c.placements.changed,
        c.trade.measured.changed,
        c.label_session.changed,
        c.labels.changed,
        c.labels.selection_changed,
        c.labels.marks_changed,
        c.keys.changed,
        c.label_dragging.changed,
        c.span_loop.changed,
        c.suggestions.changed,
        c.agreement.changed,
        c.display.theme_changed,
    )
