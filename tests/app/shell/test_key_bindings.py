"""Keys that the user chooses: no key does two things, whatever is chosen in whatever order."""

from __future__ import annotations

import contextlib
import json
import random
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st
from window_models import all_actions

from sd2app.labels.model import LabelsModel
from sd2app.settings import Settings
from sd2app.shell.keys.model import KeyBindings, KeyList, KeyRow
from sd2app.shell.program import MOUSE
from sd2app.widgets.text import canonical
from sd2core.errors import Sd2Error
from sd2core.labels.edits import Edits
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

ACTIONS = all_actions()


@dataclass(frozen=True)
class Named:
    id: str
    menu: str
    text: str
    keys: tuple[str, ...]
    tip: str = "Does something"


PLAY = Named("play", "Play", "Play", ("Space",))
NEXT = Named("next", "Labels", "Next span", ("N",))
HELP = Named("help", "Help", "Keys…", ("?", "F1"))


@pytest.fixture
def settings() -> Settings:
    return Settings.forgetful()


@pytest.fixture
def labels() -> LabelsModel:
    return LabelsModel()


@pytest.fixture
def bindings(labels, settings) -> KeyBindings:
    return KeyBindings((PLAY, NEXT, HELP), labels, settings, labels)


def with_keys(*keys: str) -> Labels:
    made = tuple(Label(f"label {key}", "#000000", key) for key in keys)
    return Labels(label_set=LabelSet("Some", made))


def test_usual_keys_until_others_are_chosen(bindings) -> None:
    assert bindings.keys_of("help") == ("?", "F1")
    assert bindings.is_usual("help")
    heard = []
    bindings.changed.connect(lambda: heard.append(bindings.keys_of("next")))
    bindings.bind("next", ["ctrl+k", "Ctrl+K"])
    assert heard == [("Ctrl+K",)]
    assert not bindings.is_usual("next")
    bindings.bind("next", [])
    assert bindings.keys_of("next") == ()
    bindings.reset("next")
    assert (bindings.keys_of("next"), bindings.is_usual("next")) == (("N",), True)


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("Space", "Space belongs to “Play” (Play). Expected: a free key for “Next span”"),
        ("f1", "F1 belongs to “Keys…” (Help)"),
        ("1", "1 belongs to the label “left-to-right”"),
        ("Alt+P", "Alt+P belongs to the menu Play itself"),
        ("Tab", "Tab goes from field to field"),
        ("Return", "Return ends typing"),
        ("", "a key that this program does not know"),
        ("Ctrl+K, Ctrl+L", "a key that this program does not know"),
    ],
)
def test_a_key_that_somebody_has_is_refused_with_the_name(bindings, key, words) -> None:
    with pytest.raises(Sd2Error) as refused:
        bindings.bind("next", ["X", key])
    assert words in str(refused.value)
    assert bindings.keys_of("next") == ("N",)


def test_a_key_that_was_given_up_can_be_had(bindings) -> None:
    bindings.bind("next", ["X"])
    bindings.bind("play", ["N"])
    with pytest.raises(Sd2Error, match="N belongs to “Play”"):
        bindings.reset("next")
    bindings.reset_all()
    assert (bindings.keys_of("play"), bindings.keys_of("next")) == (("Space",), ("N",))


def test_chosen_keys_are_kept_in_the_settings(bindings, labels, settings) -> None:
    bindings.bind("next", ["X", "/"])
    again = KeyBindings((PLAY, NEXT, HELP), labels, settings, labels)
    assert again.keys_of("next") == ("X", "/")
    # A later version gives another action a key that was chosen: it is the chosen one's.
    later = KeyBindings(
        (PLAY, NEXT, Named("new", "Edit", "New", ("X", "Q"))), labels, settings, labels
    )
    assert (later.keys_of("next"), later.keys_of("new")) == (("X", "/"), ("Q",))


@pytest.mark.parametrize(
    "stored",
    ["", "no", "[1]", '{"next": 3, "gone": ["A"]}', '{"next": [7, "??", ""], "play": null}', "{}"],
)
def test_settings_that_make_no_sense_do_no_harm(labels, settings, stored: str) -> None:
    settings.set_value("keys", stored)
    made = KeyBindings((PLAY, NEXT, HELP), labels, settings, labels)
    assert made.keys_of("play") == ("Space",)


def test_of_two_with_one_key_in_the_settings_the_first_has_it(labels, settings) -> None:
    settings.set_value("keys", json.dumps({"next": ["X"], "play": ["X", "Tab", "Y"]}))
    made = KeyBindings((PLAY, NEXT, HELP), labels, settings, labels)
    assert (made.keys_of("next"), made.keys_of("play")) == (("X",), ("Y",))


def test_a_label_has_its_key_for_as_long_as_its_recording_is_open(bindings, labels) -> None:
    labels.open(with_keys("n", "ö"))
    assert bindings.keys_of("next") == ()
    assert bindings.lent("next") == {"N": "label n"}
    assert bindings.owner("N") == "the label “label n”"
    labels.open(with_keys("m"))
    assert bindings.keys_of("next") == ("N",)


@given(seed=st.integers(0, 2**32))
def test_no_key_ever_does_two_things(seed: int) -> None:
    rng, labels = random.Random(seed), LabelsModel()
    bindings = KeyBindings(ACTIONS, labels, Settings.forgetful(), labels)
    ids = [action.id for action in ACTIONS]
    keys = [key for action in ACTIONS for key in action.keys] + ["Ctrl+K", "J", "Tab"]
    for _ in range(30):
        with contextlib.suppress(Sd2Error):
            rng.choice(
                [
                    lambda: bindings.bind(rng.choice(ids), rng.sample(keys, rng.randint(0, 2))),
                    lambda: bindings.bind(rng.choice(ids), []),
                    lambda: bindings.reset(rng.choice(ids)),
                    lambda: labels.open(with_keys(*rng.sample("123abcdnpz", 3))),
                ]
            )()
        used = [key for one in ids for key in bindings.keys_of(one)]
        used += [canonical(label.key) for label in labels.labels.label_set.labels]
        assert len(used) == len({*used})
        assert "Tab" not in used


def test_usual_keys_are_written_as_qt_writes_them() -> None:
    for action in ACTIONS:
        for key in action.keys:
            assert canonical(key) == key


# --- the list -----------------------------------------------------------------------------


@pytest.fixture
def listed(bindings, labels) -> KeyList:
    def apply(change) -> bool:
        labels.set_labels(change(Edits(labels.labels, Timebase.regular(10, 10.0))).labels)
        return True

    return KeyList(bindings, labels, MOUSE, apply)


def row(listed: KeyList, text: str) -> KeyRow:
    return next(one for one in listed.rows() if text in one.text)


def keys(listed: KeyList, text: str) -> str:
    return listed.keys_text(row(listed, text))


def test_actions_labels_and_the_mouse_are_listed(listed) -> None:
    assert keys(listed, "Next span") == "N"
    assert keys(listed, "left-to-right") == "1"
    assert keys(listed, MOUSE[0][1]) == MOUSE[0][0]
    menus = [one.menu for one in listed.rows()]
    assert menus == sorted(menus, key=["Play", "Labels", "Help", "Mouse"].index)


@pytest.mark.parametrize(
    ("search", "found"),
    [("F1", ["Keys…"]), ("next SPAN", ["Next span"]), ("space", ["Play"]), ("no such", [])],
)
def test_a_search_goes_through_names_menus_and_keys(listed, search, found) -> None:
    assert [one.text for one in listed.rows(search)] == found


def test_keys_are_changed_added_taken_away_and_given_back(listed, bindings) -> None:
    listed.change(row(listed, "Next span"), "k")
    listed.change(row(listed, "Next span"), "J", besides=True)
    assert keys(listed, "Next span") == "K, J"
    assert not listed.is_usual(row(listed, "Next span"))
    listed.clear(row(listed, "Next span"))
    assert keys(listed, "Next span") == ""
    listed.reset(row(listed, "Next span"))
    assert (keys(listed, "Next span"), bindings.keys_of("next")) == ("N", ("N",))


def test_a_label_gets_one_character_that_nobody_has(listed, labels) -> None:
    listed.change(row(listed, "left-to-right"), "Q")
    assert labels.labels.label_set.find("left-to-right").key == "q"
    for key, words in (
        ("N", "N belongs to “Next span”"),
        ("2", "2 belongs to the label “right-to-left”"),
        ("Ctrl+Q", "one character"),
        ("Space", "one character"),
    ):
        with pytest.raises(Sd2Error, match=words):
            listed.change(row(listed, "left-to-right"), key)
    listed.clear(row(listed, "left-to-right"))
    assert labels.labels.label_set.find("left-to-right").key == ""


def test_a_key_that_a_label_took_says_so(listed, labels) -> None:
    labels.open(with_keys("n"))
    assert keys(listed, "Next span") == "N: now “label n”"
