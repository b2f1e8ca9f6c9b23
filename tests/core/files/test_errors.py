"""Errors that another process makes anew."""

from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Cure, Sd2Error

WORDS = st.text(max_size=20)


@given(WORDS, WORDS, WORDS, st.none() | st.just(Cure("turn", "z180", "Turn it")))
def test_what_is_sent_says_the_same(found, expected, remedy, cure):
    error = Sd2Error(found, expected, remedy)
    error.cure = cure

    assert Sd2Error(**error.within("a.npz").arguments).words == error.within("a.npz").words
