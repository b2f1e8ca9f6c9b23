"""Hypothesis strategies for labels that a user could make, and worse."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import strategies as st

from sd2core.labels.label_set import GESTURES, Label, LabelSet
from sd2core.labels.spans import ORIGINS, OVERLAPS, Labels, LabelTrack, Span

# What check_name lets through: everything that can be shown, and the plain space.
_SHOWN = st.characters(
    exclude_categories=("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp", "Zs"), include_characters=" "
)
_HARD_NAMES = (
    'a "b" c',
    "x, y; z",
    " spaces ",
    "Wischen nach links – Übung",
    "手を振る",
    "#1",
    "100 % %2C",
    "<a&b>",
    "a|b\\",
    "=cmd|' /C calc'!A0",
    "-x",
    "'@SUM(A1)",
    "''+1",
    "'twas",
    "Gestures [overlap 1]",
    "Gestures [overlap 0]",
    "Gestures - note",
)
names = st.one_of(
    st.sampled_from(("Gestures", "left-to-right", *_HARD_NAMES)),
    st.text(_SHOWN, min_size=1, max_size=8).filter(str.strip),
)
_NOTE_CHARACTERS = st.characters(
    exclude_categories=("Cc", "Cs", "Cn"), include_characters="\n\r\t\",;'#%<&\\|"
)
notes = st.one_of(st.just(""), st.text(_NOTE_CHARACTERS, max_size=12), st.just('a\r\n"b", c\n'))
finite_times_s = st.floats(-50.0, 1e5, allow_nan=False)
times_s = st.floats(0.0, 1e5, allow_nan=False)
milliseconds_s = st.integers(0, 10**7).map(lambda ms: ms / 1000)
label_sets = st.one_of(
    st.just(GESTURES),
    st.builds(
        lambda name, labels: LabelSet(name, tuple(labels)),
        names,
        st.lists(
            st.builds(
                Label,
                names,
                st.integers(0, 2**24 - 1).map(lambda rgb: f"#{rgb:06x}"),
                st.sampled_from(("", "a", "1", "<", "ü")),
                names,
            ),
            max_size=3,
            unique_by=(lambda one: one.name, lambda one: one.key or one.name + "key"),
        ),
    ),
)


@st.composite
def any_labels(
    draw: st.DrawFn, edges: st.SearchStrategy[float] = times_s, min_spans: int = 0
) -> Labels:
    """Tracks with and without overlaps, touching spans, notes of every kind, ids in any order."""
    tracks = draw(
        st.lists(
            st.builds(LabelTrack, names, st.sampled_from(OVERLAPS)),
            min_size=1,
            max_size=3,
            unique_by=lambda track: track.name,
        )
    )
    extents: list[tuple[str, float, float]] = []
    for track in tracks:
        some_s = sorted(draw(st.lists(edges, max_size=6, unique=True)))
        pairs = list(pairwise(some_s))
        if track.overlap == "free":
            pairs += draw(st.lists(st.sampled_from(pairs), max_size=2)) if pairs else []
            pairs += list(zip(some_s, some_s[2:], strict=False))
        else:
            pairs = [pair for pair in pairs if draw(st.integers(0, 3))]
        extents += [(track.name, start_s, end_s) for start_s, end_s in pairs]
    if len(extents) < min_spans:
        extents.append((tracks[0].name, 1e5 + 1, 1e5 + 2))
    ids = draw(
        st.lists(st.integers(1, 10**9), min_size=len(extents), max_size=len(extents), unique=True)
    )
    spans = [
        Span(
            number,
            track,
            start_s,
            end_s,
            draw(names),
            draw(notes),
            draw(notes),
            draw(st.none() | st.floats(0, 1)),
            draw(st.sampled_from(ORIGINS)),
            draw(st.just("") | names),
        )
        for number, (track, start_s, end_s) in zip(ids, extents, strict=True)
    ]
    return Labels(tuple(tracks), tuple(spans), draw(label_sets))
