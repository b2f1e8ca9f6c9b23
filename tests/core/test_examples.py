"""Every name that the library exports has an example in its docstring, which runs."""

from __future__ import annotations

import ast
import doctest
import inspect
from importlib import import_module
from itertools import pairwise
from typing import Any

import pytest

import sd2core


def documentation(name: str) -> str:
    """Docstring of a class or function; of a constant, the string that follows it."""
    value: Any = getattr(sd2core, name)
    if inspect.isclass(value) or inspect.isroutine(value):
        return inspect.getdoc(value) or ""
    home = f"sd2core.{sd2core._HOME.get(name, 'version')}"
    while True:
        body = ast.parse(inspect.getsource(import_module(home))).body
        for statement, following in pairwise(body):
            if isinstance(statement, ast.Assign | ast.AnnAssign) and name in ast.unparse(
                statement.targets[0] if isinstance(statement, ast.Assign) else statement.target
            ):
                assert isinstance(following, ast.Expr), f"{name} has no docstring"
                return inspect.cleandoc(ast.literal_eval(following.value))
        # A package hands on what a module of its own holds.
        (home,) = (
            statement.module or ""
            for statement in body
            if isinstance(statement, ast.ImportFrom)
            and name in [alias.name for alias in statement.names]
        )


@pytest.mark.parametrize("name", sd2core.__all__)
def test_the_example_runs(name: str) -> None:
    test = doctest.DocTestParser().get_doctest(documentation(name), {}, name, None, None)
    assert test.examples, f"sd2core.{name} has no example"
    said: list[str] = []
    failed, _ = doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert not failed, "".join(said)
