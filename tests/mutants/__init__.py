"""Seeded damage to files, to see that every reader refuses it in words.

``python -m tests.mutants --count 10000`` (``make fuzz``) tries that many and prints what happened.
A mutant must be read or refused with ``Sd2Error`` that names it, by a process that lives on, in
10 s and 1 GB. A kind of file to try is a :class:`~tests.mutants.target.Target` in a list of this
folder that ``TARGETS`` takes in.
"""

from __future__ import annotations

from tests.mutants import arrays, texts

TARGETS = {target.name: target for target in (*arrays.TARGETS, *texts.TARGETS)}
