"""The import graph: no circle of files, models without widgets, views that are their feature's own.

Imports in functions and under ``TYPE_CHECKING`` count like any other.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
ROOTS = {"sd2core": REPOSITORY / "sd2core", "sd2app": REPOSITORY / "app" / "sd2app"}
SHARED = {"background", "manual", "session", "widgets"}
"""Packages of the window that are no features."""
ASSEMBLING = {"feature", "actions"}
"""Modules of a feature that hand its models and views to the shell."""
MODELS = {"history", "library", "model", "request", "results", "run", "setup", "text"}

Graph = Mapping[str, set[str]]


def name_of(file: Path, root: Path) -> str:
    parts = [root.name, *file.relative_to(root).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """Statements in a module at any depth; no import is within an expression."""
    for part in ("body", "orelse", "finalbody", "handlers", "cases"):
        inner = getattr(node, part, None)
        for each in inner if isinstance(inner, list) else ():
            yield each
            yield from statements(each)


@cache
def imported_by(file: Path) -> tuple[str, ...]:
    """Names of modules, or of things in modules, that a file imports anywhere."""
    found: list[str] = []
    for node in statements(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file} has a relative import"
            found += (f"{node.module}.{alias.name}" for alias in node.names)
    return tuple(found)


def nearest(name: str, known: Mapping[str, Path]) -> str:
    """The module that a dotted name is in; empty outside the program."""
    while name and name not in known:
        name = name.rpartition(".")[0]
    return name


@pytest.fixture(scope="module")
def files() -> Mapping[str, Path]:
    return {
        name_of(file, root): file
        for root in ROOTS.values()
        for file in root.rglob("*.py")
        if "resources" not in file.parts
    }


@pytest.fixture(scope="module")
def graph(files: Mapping[str, Path]) -> Graph:
    """Modules with those that they import; a module's own package does not count."""
    return {
        name: {
            target
            for imported in imported_by(file)
            if (target := nearest(imported, files)) and not f"{name}.".startswith(f"{target}.")
        }
        for name, file in files.items()
    }


def circle_in(graph: Graph) -> list[str]:
    """Modules that import each other in a ring; empty where there is none."""
    done: set[str] = set()
    for start in graph:
        path: list[str] = []
        stack: list[tuple[str, Iterator[str]]] = [(start, iter(sorted(graph[start])))]
        path.append(start)
        while stack:
            name, others = stack[-1]
            for other in others:
                if other in path:
                    return [*path[path.index(other) :], other]
                if other not in done:
                    stack.append((other, iter(sorted(graph[other]))))
                    path.append(other)
                    break
            else:
                done.add(name)
                stack.pop()
                path.pop()
    return []


def test_a_ring_is_found_and_a_tree_is_none() -> None:
    tree = {"a": {"b", "c"}, "b": {"c"}, "c": set()}
    assert circle_in(tree) == []
    assert circle_in({**tree, "c": {"a"}}) in (["a", "b", "c", "a"], ["a", "c", "a"])


def test_no_circle_of_files(graph: Graph) -> None:
    ring = circle_in(graph)
    assert not ring, " imports ".join(ring)


def feature_of(name: str) -> str:
    """Feature that a module of the window belongs to; empty where it is none's."""
    parts = name.split(".")
    return parts[1] if parts[0] == "sd2app" and len(parts) > 2 else ""


@pytest.fixture(scope="module")
def views(files: Mapping[str, Path]) -> set[str]:
    """Modules of the window that make widgets."""
    widgets = ("PySide6.QtWidgets", "vtkmodules")
    return {
        name
        for name, file in files.items()
        if name.startswith("sd2app.") and any(one.startswith(widgets) for one in imported_by(file))
    }


def reached(graph: Graph, start: str) -> set[str]:
    """All that a module imports, directly or not."""
    found, stack = set(), [start]
    while stack:
        for target in graph[stack.pop()] - found:
            found.add(target)
            stack.append(target)
    return found


def is_model(name: str) -> bool:
    """True for modules that are models by their name."""
    last = name.rpartition(".")[2]
    return feature_of(name) != "" and (last in MODELS or last.endswith("_model"))


def test_models_reach_no_widget(graph: Graph, views: set[str]) -> None:
    models = [name for name in graph if is_model(name)]
    assert {feature_of(name) for name in models} >= {"maps", "labels", "denoise", "training"}
    # What the shell offers to features is a protocol; it names widgets and makes none.
    made = views - {"sd2app.feature"}
    wrong = {
        f"{name} reaches {target}" for name in models for target in reached(graph, name) & made
    }
    assert not wrong, sorted(wrong)


def test_session_and_background_make_no_widgets(views: set[str]) -> None:
    assert not {name for name in views if feature_of(name) in {"session", "background"}}


def test_views_of_a_feature_are_its_own(graph: Graph, views: set[str]) -> None:
    wrong = {
        f"{name} imports {target}"
        for name, targets in graph.items()
        for target in targets & views
        if feature_of(name) not in {"", "shell", feature_of(target)}
        and feature_of(target) not in {"", *SHARED}
        and target.rpartition(".")[2] not in ASSEMBLING
        and name.rpartition(".")[2] not in ASSEMBLING
    }
    assert not wrong, sorted(wrong)


def test_folders_and_loose_modules_stay_few(files: Mapping[str, Path]) -> None:
    for folder in {file.parent for file in files.values()}:
        count = len(list(folder.glob("*.py")))
        assert count <= 45, f"{folder} holds {count} files"
    loose = list(ROOTS["sd2core"].glob("*.py"))
    assert len(loose) <= 10, sorted(file.name for file in loose)
