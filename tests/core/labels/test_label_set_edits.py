"""The label set is edited one thing at a time; spans lose nothing by it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.labels.field_edits import (
    add_label,
    change_label,
    move_label,
    new_label,
    remove_label,
    set_label_set,
)
from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack, Span

LABELS = Labels(
    (LabelTrack("Gestures"),),
    (
        Span(1, "Gestures", 1.0, 2.0, "up-to-down"),
        Span(2, "Gestures", 2.0, 2.5, "down-to-up"),
        Span(3, "Gestures", 3.0, 3.5, "up-to-down", note="low"),
    ),
)
NAMES = [one.name for one in GESTURES.labels]


def named(labels: Labels) -> list[str]:
    return [one.name for one in labels.label_set.labels]


def test_another_set_keeps_the_spans() -> None:
    other = LabelSet("Other", (Label("wave", "#000000"),))
    after = set_label_set(LABELS, other).labels
    assert after.label_set == other
    assert after.spans == LABELS.spans
    assert set_label_set(after, GESTURES).labels == LABELS


def test_a_label_is_renamed_wherever_it_stands() -> None:
    after = change_label(LABELS, "up-to-down", name="fall").labels
    assert [span.label for span in after.spans] == ["fall", "down-to-up", "fall"]
    assert named(after)[2] == "fall"
    assert change_label(after, "fall", name="up-to-down").labels == LABELS


def test_names_that_are_taken_or_unknown() -> None:
    with pytest.raises(Sd2Error, match="share the name background"):
        change_label(LABELS, "up-to-down", name="background")
    with pytest.raises(Sd2Error, match=f"The set {GESTURES.name!r} has no label 'fall'"):
        change_label(LABELS, "fall", name="up")


@given(fields=st.fixed_dictionaries({"key": st.sampled_from(["", "q", "ö"])}))
def test_colour_key_and_class_change_alone(fields: dict[str, str]) -> None:
    after = change_label(LABELS, "up-to-down", key=fields["key"]).labels
    after = change_label(after, "up-to-down", colour="#332288").labels
    after = change_label(after, "up-to-down", gesture_class="").labels
    expected = Label("up-to-down", "#332288", fields["key"], "")
    assert after.label_set.labels == (*GESTURES.labels[:2], expected, *GESTURES.labels[3:])
    assert after.spans == LABELS.spans


@pytest.mark.parametrize("key", ["1", "ab", " ", "\t"])
def test_a_key_is_one_character_that_no_other_label_has(key: str) -> None:
    with pytest.raises(Sd2Error, match=r"share the key 1|The key of the label"):
        change_label(LABELS, "up-to-down", key=key)


@given(name=st.sampled_from(NAMES), place=st.integers(0, 4))
def test_a_moved_label_stands_where_it_was_put_and_the_others_in_their_order(
    name: str, place: int
) -> None:
    after = move_label(LABELS, name, place).labels
    assert named(after)[place] == name
    assert [one for one in named(after) if one != name] == [one for one in NAMES if one != name]
    assert move_label(after, name, NAMES.index(name)).labels == LABELS


def test_spans_keep_a_label_that_is_removed_and_the_step_says_so() -> None:
    edit = remove_label(LABELS, "up-to-down")
    assert edit.name == "Remove label, 2 spans keep it"
    assert edit.labels.spans == LABELS.spans
    assert named(edit.labels) == [one for one in NAMES if one != "up-to-down"]
    assert remove_label(LABELS, "down-to-up").name == "Remove label, 1 span keeps it"
    assert remove_label(LABELS, "background").name == "Remove label"


def test_or_get_another_one() -> None:
    edit = remove_label(LABELS, "up-to-down", "background")
    assert edit.name == "Remove label, 2 spans become background"
    assert [span.label for span in edit.labels.spans] == ["background", "down-to-up", "background"]
    for other in ("up-to-down", "unheard of"):
        with pytest.raises(Sd2Error, match=r"to get that label itself|has no label"):
            remove_label(LABELS, "up-to-down", other)


@given(count=st.integers(1, 25))
def test_there_is_always_room_for_a_new_label(count: int) -> None:
    labels = LABELS
    for _ in range(count):
        labels = add_label(labels, new_label(labels.label_set)).labels
    assert labels.label_set.labels[:5] == GESTURES.labels
    made = labels.label_set.labels[5:]
    assert len(made) == count
    colours = [one.colour for one in labels.label_set.labels]
    assert len({*colours}) == min(len(colours), 8)
    assert [one.key for one in made] == [*"6789", *[""] * count][:count]


def test_a_label_is_added_after_the_others() -> None:
    made = Label("wave", "#882255")
    assert add_label(LABELS, made).labels.label_set.labels == (*GESTURES.labels, made)
    with pytest.raises(Sd2Error, match="share the name"):
        add_label(LABELS, replace(made, name="background"))


def test_what_changes_nothing_gives_the_very_same_labels() -> None:
    for edit in (
        change_label(LABELS, "up-to-down", key="3"),
        change_label(LABELS, "up-to-down", colour="#d55e00"),
        change_label(LABELS, "up-to-down", gesture_class="vertical"),
        move_label(LABELS, "up-to-down", 2),
        change_label(LABELS, "up-to-down", name="up-to-down"),
        set_label_set(LABELS, GESTURES),
    ):
        assert edit.labels is LABELS
