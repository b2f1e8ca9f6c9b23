"""Choices are of the types of their defaults, and are there again at the next start."""

from __future__ import annotations

import pytest

from sd2app.settings import Settings, StoredChoices

DEFAULTS = {"steps": 300, "delay_s": 0.5, "model": "lstm", "export": True}
KNOWN = {"model": ("lstm", "s4")}


def test_what_is_chosen_is_kept() -> None:
    settings = Settings.forgetful()
    first = StoredChoices(settings, "here", DEFAULTS, KNOWN)
    assert first.others == {}
    chosen = {"steps": 20, "delay_s": 0.0, "model": "s4", "export": False}
    for name, value in chosen.items():
        assert first.set(name, value)
        assert not first.set(name, value)
    assert first.others == chosen
    again = StoredChoices(settings, "here", DEFAULTS, KNOWN)
    assert {name: again[name] for name in DEFAULTS} == chosen
    assert StoredChoices(settings, "elsewhere", DEFAULTS, KNOWN).others == {}


def test_numbers_are_of_the_type_of_the_default() -> None:
    choices = StoredChoices(Settings.forgetful(), "here", DEFAULTS)
    assert not choices.set("steps", 300.0)
    choices.set("steps", 20.0)
    assert isinstance(choices["steps"], int)


@pytest.mark.parametrize(("name", "kept"), [("steps", "many"), ("model", "unheard of")])
def test_what_cannot_be_is_as_by_default(name: str, kept: str) -> None:
    settings = Settings.forgetful()
    settings.set_value(f"here/{name}", kept)
    assert StoredChoices(settings, "here", DEFAULTS, KNOWN)[name] == DEFAULTS[name]


def test_there_are_no_others() -> None:
    choices = StoredChoices(Settings.forgetful(), "here", DEFAULTS)
    with pytest.raises(KeyError):
        choices.set("colour", "blue")
    with pytest.raises(KeyError):
        choices["colour"]
