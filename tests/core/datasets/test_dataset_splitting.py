"""Splits follow from names: who is added moves nobody else, as long as no part would be empty."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.datasets.splitting import number_of, reassigned, split_people
from sd2core.errors import Sd2Error
from sd2core.train.data import Split

names = st.lists(st.text(min_size=1, max_size=4), min_size=1, max_size=40, unique=True)


def part_of(split: Split) -> dict[str, str]:
    parts = {"train": split.training, "validation": split.validation, "test": split.test}
    return {name: part for part, people in parts.items() for name in people}


def by_number(name: str) -> str:
    sixths = number_of(name) * 6
    return "test" if sixths < 1 else "validation" if sixths < 2 else "train"


def as_dict(split: Split) -> dict[str, tuple[str, ...]]:
    return {"train": split.training, "validation": split.validation, "test": split.test}


@given(names)
def test_everybody_is_in_one_part_and_no_part_is_empty_or_too_large(people: list[str]) -> None:
    split = split_people(people)
    assert sorted(part_of(split)) == sorted(people)
    sizes = [len(split.test), len(split.validation), len(split.training)]
    assert [size > 0 for size in sizes] == [len(people) > 2, len(people) > 1, True]
    assert max(sizes[:2]) <= max(1, len(people) // 3)


@given(names, st.randoms())
def test_the_order_of_people_is_nothing(people: list[str], random: object) -> None:
    other = list(people)
    random.shuffle(other)  # type: ignore[attr-defined]
    assert part_of(split_people(other)) == part_of(split_people(people))


@given(names)
def test_the_number_rules_and_exceptions_are_named(people: list[str]) -> None:
    split = split_people(people)
    rule = {name: by_number(name) for name in people}
    moved = {name for name, part in part_of(split).items() if part != rule[name]}
    assert {*reassigned(as_dict(split))} == moved
    counts = [sum(part == one for part in rule.values()) for one in ("test", "validation")]
    if all(1 <= count <= max(1, len(people) // 3) for count in counts) and len(people) > 2:
        assert not moved
    # Nobody is moved from one part that is kept out to the other while others could be.
    if not split.by_take and sum(part == "train" for part in rule.values()) > 2:
        pairs = {(rule[name], part) for name, part in part_of(split).items() if name in moved}
        assert not pairs & {("test", "validation"), ("validation", "test")}


@given(st.integers(0, 10**6))
def test_who_is_added_moves_nobody_in_a_large_set(first: int) -> None:
    people = [f"person {number}" for number in range(first, first + 120)]
    before = part_of(split_people(people[:-1]))
    assert {**before, people[-1]: by_number(people[-1])} == part_of(split_people(people))
    assert before == {name: by_number(name) for name in people[:-1]}


def test_numbers_are_spread_evenly_and_stay_what_they_are() -> None:
    numbers = [number_of(f"s{number}") for number in range(2000)]
    assert sum(number < 1 / 6 for number in numbers) == pytest.approx(2000 / 6, abs=50)
    assert sum(numbers) / 2000 == pytest.approx(0.5, abs=0.02)
    # echo -n anna | sha256sum begins with 55579b55….
    assert number_of("anna") == pytest.approx(0x55579B55 / 2**32, abs=1e-9)


def test_names_go_before_the_rule() -> None:
    people = [f"s{number}" for number in range(12)]
    split = split_people(people, validation=["s3"])
    assert split.validation == ("s3",)
    assert split.test
    alone = split_people(people, test=["s0", "s1"])
    assert alone.test == ("s0", "s1")
    assert alone.validation
    assert split_people(people, [], []).training == tuple(people)
    with pytest.raises(Sd2Error, match="'nobody' is to be a test subject"):
        split_people(people, test=["nobody"])
