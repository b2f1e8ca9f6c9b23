"""Protocols, and sessions without a window, a clock, a camera or a radar."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.cli.guiding import guide
from sd2core.errors import Sd2Error
from sd2core.labels.label_set import GESTURES
from sd2core.live.consent import FILE_NAME, Consent
from sd2core.live.protocol import (
    PAPER,
    Gesture,
    Protocol,
    Take,
    content_of,
    protocol_of,
    read_protocol,
    write_protocol,
)
from sd2core.live.session import Session

_NAMES = st.lists(
    st.sampled_from(["anna", "ben", "cem", "dora"]), min_size=1, max_size=4, unique=True
)
_GESTURES = st.lists(st.sampled_from(["up", "down", "left"]), min_size=1, max_size=3, unique=True)
_LINE = st.text(st.sampled_from('\r\t"\\ a\x7f') | st.characters(exclude_categories=["Cs"]))
_TEXTS = st.lists(_LINE, max_size=4).map("\n".join)
_HEAD = 'format = "sd2-protocol"\nversion = 1\ntitle = "Try"\n'


def _protocol(people: list[str], gestures: list[str], **fields: object) -> Protocol:
    return Protocol(
        format="sd2-protocol",
        version=1,
        title="Try",
        people=tuple(people),
        gestures=tuple(Gesture(name=name, instruction=f"Go {name}") for name in gestures),
        take_s=2.0,
        pause_s=1.0,
        countdown_s=1.0,
        **fields,
    )


PROTOCOLS = st.builds(
    _protocol,
    _NAMES,
    _GESTURES,
    repetitions=st.integers(1, 3),
    order=st.sampled_from(["fixed", "random"]),
    seed=st.integers(0, 99),
)


def test_a_recording_is_no_folder_for_takes(tmp_path: Path) -> None:
    folder = tmp_path / "walk.sd2"
    folder.mkdir()
    (folder / "recording.json").touch()
    with pytest.raises(Sd2Error, match=r"walk\.sd2 is a recording"):
        guide(PAPER, folder, lambda _: pytest.fail("it is recorded into"), as_json=True)
    assert [one.name for one in folder.iterdir()] == ["recording.json"]


def test_where_nobody_can_press_a_key_none_is_waited_for(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="nobody can press one"):
        guide(
            read_protocol(PAPER),
            tmp_path / "s",
            lambda _: pytest.fail("it is recorded"),
            as_json=True,
        )


KEYS = ["go on", "again", "skip", "agree", "decline", ""]
_ENDS = {"ready": "go on", "consent": "agree"}


def _drive(session: Session, keys: list[str]) -> list[str]:
    """Names of the takes that are stored, second by second, with a key at each; then to its end."""
    stored, now_s = [], 0.0
    while session.phase != "over":
        key = keys.pop(0) if keys else _ENDS.get(session.phase, "")
        match key:
            case "agree":
                session.agree()
            case "decline":
                session.decline(now_s)
            case "go on":
                session.go_on()
            case "again":
                session.again(now_s)
            case "skip":
                session.skip(now_s)
        session.advance(now_s)
        if session.phase == "opening":
            session.opened(now_s)
        elif session.phase == "storing":
            assert session.take is not None
            stored.append(session.take.name)
            session.stored(now_s)
        now_s += 1.0
        assert now_s < 10_000.0
    return stored


@given(PROTOCOLS)
def test_without_keys_every_take_is_made_once(protocol: Protocol) -> None:
    wanted = {
        f"{person}-{gesture.name}-{repetition}"
        for person in protocol.people
        for gesture in protocol.gestures
        for repetition in range(1, protocol.repetitions + 1)
    }
    session = Session(protocol)
    stored = _drive(session, [])
    assert Counter(stored) == Counter(wanted)
    assert session.missing == ()
    # People come one after another, and make every gesture once in each round.
    assert [one.person for one in protocol.takes] == sorted(
        (one.person for one in protocol.takes), key=protocol.people.index
    )
    assert [one.repetition for one in protocol.takes] == [
        number
        for _ in protocol.people
        for number in range(1, protocol.repetitions + 1)
        for _ in protocol.gestures
    ]


@given(PROTOCOLS, st.lists(st.sampled_from(KEYS), max_size=60))
def test_whatever_keys_are_pressed_what_was_not_stored_is_missing(
    protocol: Protocol, keys: list[str]
) -> None:
    pressed = list(keys)
    session = Session(protocol)
    stored = Counter(_drive(session, list(keys)))
    names = [take.name for take in protocol.takes]
    assert [one.name for one in session.missing] == [name for name in names if name not in stored]
    assert len(session.missing) <= pressed.count("skip")
    assert stored.total() - len(stored) <= pressed.count("again")


@given(PROTOCOLS, st.lists(st.sampled_from(KEYS), max_size=60), st.booleans())
def test_nobody_is_recorded_who_has_not_agreed(
    protocol: Protocol, keys: list[str], first_agreed: bool
) -> None:
    protocol = replace(protocol, consent="\nYou are filmed.\n")
    first = protocol.people[0]
    session = Session(protocol, agreed=[first] if first_agreed else [])
    agreed, asked = {first} if first_agreed else set(), Counter[str]()
    was_agreed = Session.agree

    def agree() -> None:
        if session.phase == "consent":
            agreed.add(session.take.person)
            asked[session.take.person] += 1
        was_agreed(session)

    session.agree = agree  # type: ignore[method-assign]
    stored = _drive(session, keys)
    people = {take.person for take in protocol.takes if take.name in stored}
    assert people <= agreed
    assert not asked or max(asked.values()) == 1  # nobody is asked twice
    assert not (first_agreed and asked[first])


def test_who_does_not_agree_is_left_out_and_the_next_is_asked() -> None:
    session = Session(_protocol(["anna", "ben"], ["up", "down"], consent="You are filmed."))
    for key in (session.go_on, lambda: session.advance(1e6)):
        key()
        assert session.phase == "consent"
    session.decline(0.0)
    assert (session.phase, session.take.person) == ("consent", "ben")
    session.agree()
    assert session.phase == "ready"
    session.go_on()
    assert session.phase == "opening"
    assert [one.person for one in session.missing] == 2 * ["anna"] + 2 * ["ben"]


def test_agreements_hold_for_their_text_and_from_one_session_to_the_next(tmp_path: Path) -> None:
    before = datetime.now(UTC) - timedelta(seconds=1)
    Consent(tmp_path, "You are filmed.").agree("anna")
    again = Consent(tmp_path, "You are filmed.")
    assert [*again.agreements] == ["anna"]
    assert before <= again.agreements["anna"].agreed_at <= datetime.now(UTC)
    changed = Consent(tmp_path, "You are filmed and heard.")
    assert not changed.agreements
    changed.agree("ben")
    kept = json.loads((tmp_path / FILE_NAME).read_text(encoding="utf-8"))
    # Which text it was can be read years later.
    texts = [kept["texts"][one["text_sha256"]] for one in kept["agreements"]]
    assert texts == ["You are filmed.", "You are filmed and heard."]
    assert [*Consent(tmp_path, "You are filmed.").agreements] == ["anna"]


def test_agreements_that_cannot_be_read_are_no_agreements(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text('{"agreements": [{"person": "anna"}]}', encoding="utf-8")
    with pytest.raises(Sd2Error, match=r"consent\.json.*agreed_at"):
        Consent(tmp_path, "You are filmed.")


@given(PROTOCOLS, st.integers(0, 36))
def test_a_session_goes_on_where_it_was_interrupted(protocol: Protocol, made: int) -> None:
    names = [take.name for take in protocol.takes]
    session = Session(protocol, [*names[:made], "what-is-something-else-1"])
    assert _drive(session, []) == names[made:]


@given(PROTOCOLS)
def test_a_persons_order_does_not_depend_on_the_others(protocol: Protocol) -> None:
    last = protocol.people[-1]
    alone = replace(protocol, people=(last,))
    assert alone.takes == tuple(one for one in protocol.takes if one.person == last)


def test_again_repeats_the_take_that_was_made_last_also_after_the_last_of_all() -> None:
    session = Session(_protocol(["anna"], ["up", "down"], order="fixed"))
    session.go_on()
    for name in ("up", "down"):
        assert session.take == Take("anna", name, 1)
        session.opened(0.0)
        session.advance(1.0)
        assert (session.phase, session.prompt_s) == ("prompt", 1.0)
        assert session.left_s(1.5) == 1.5
        session.advance(3.0)
        session.stored(3.0)
        assert session.phase == "pause"
        session.advance(4.0)
    assert session.phase == "over"  # nobody has pressed a key in the last pause
    session = Session(_protocol(["anna"], ["up"]))
    session.go_on()
    session.opened(0.0)
    session.advance(1.0)
    session.advance(3.0)
    session.stored(3.0)
    session.again(3.5)
    assert session.take == Take("anna", "up", 1)
    assert session.missing == ()  # the first one is there until the second is


def test_a_new_person_is_waited_for() -> None:
    session = Session(_protocol(["anna", "ben"], ["up", "down"]))
    session.advance(1e6)
    assert session.phase == "ready"
    session.skip(0.0)
    assert session.phase == "ready"
    session.skip(0.0)
    assert session.take is not None
    assert (session.phase, session.take.person) == ("ready", "ben")


def test_the_papers_protocol_is_the_papers() -> None:
    protocol = read_protocol(PAPER)
    assert len(protocol.people) == 6
    assert protocol.take_s == 15.0
    names = [one.name for one in GESTURES.labels]
    assert [one.name for one in protocol.gestures] == names[:4]
    assert [one.name for one in protocol.label_set.labels] == names
    for label in protocol.label_set.labels:
        known = GESTURES.find(label.name)
        assert known is not None
        assert label.gesture_class == known.gesture_class


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("people = []", r"line 4: people is \[\]"),
        ('people = ["a/b"]', r"line 4: people\.0 is 'a/b'"),
        ('people = ["anna"]\ntake_s = 0', r"line 5: take_s is 0"),
        ('people = ["anna"]\nkeys = 1', r"line 5: keys is not known"),
        ('people = ["anna"]\nvideo = "burn"', r"line 5: video is 'burn'.*'keep', 'blur' or 'drop'"),
        ('people = ["anna", "Anna"]', r"two recordings would be called anna-up-1"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "mine.toml"
    gestures = '[[gestures]]\nname = "up"\ninstruction = "Go up"\n'
    file.write_text(f"{_HEAD}{text}\n{gestures}", encoding="utf-8")
    with pytest.raises(Sd2Error, match=words) as raised:
        read_protocol(file)
    assert "mine.toml" in str(raised.value)


@given(
    PROTOCOLS,
    _TEXTS,
    st.floats(0.0, 3600.0),
)
def test_what_is_written_is_read_again(
    tmp_path_factory: pytest.TempPathFactory, protocol: Protocol, text: str, pause_s: float
) -> None:
    file = tmp_path_factory.mktemp("protocols") / "mine.toml"
    protocol = replace(protocol, consent=text, pause_s=pause_s, title=f"{text}.")
    write_protocol(file, protocol)
    assert read_protocol(file) == protocol
    assert protocol_of(content_of(protocol)) == protocol


def test_a_text_of_several_lines_is_written_as_such(tmp_path: Path) -> None:
    text = 'You "are"\n\nfilmed \\n here'
    write_protocol(tmp_path / "mine.toml", _protocol(["anna"], ["up"], consent=text))
    lines = (tmp_path / "mine.toml").read_text(encoding="utf-8").splitlines()
    begin = lines.index('consent = """')
    assert lines[begin + 1 : begin + 4] == ['You \\"are\\"', "", 'filmed \\\\n here"""']
    assert "take_s = 2.0" in lines
    assert "repetitions" not in " ".join(lines)  # as by default


def test_two_names_that_run_into_each_other_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="would be called a-b-c-1"):
        _protocol(["a", "a-b"], ["b-c", "c"])


def test_a_protocol_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"no protocol .*mine\.toml.*the name paper"):
        read_protocol(tmp_path / "mine.toml")
