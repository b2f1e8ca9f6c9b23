"""Progress of parts adds up to that of the whole."""

from __future__ import annotations

from sd2core.progress import part_of


def test_parts_of_parts_report_to_the_whole() -> None:
    said: list[tuple[int, int]] = []
    second = part_of(lambda *one: said.append(one), 1, 2, 4)
    second(0, 0)
    maps = part_of(second, 0.0, 0.9)
    maps(5, 10)
    maps(10, 10)
    second(1, 1)
    assert said == [(1000, 4000), (1450, 4000), (1900, 4000), (2000, 4000)]
