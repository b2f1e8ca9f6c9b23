"""Signatures and docstrings of the library as Markdown.

They are read from its source: importing what learns would load torch into the window.
"""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import sd2core

_ROOT = Path(sd2core.__file__).resolve().parents[1]
_COLUMNS = 82
_LISTED = {"Attributes", "Parameters", "Raises", "Returns", "Yields"}
"""Sections of a docstring whose lines are names, each with an indented text."""

Definition = ast.FunctionDef | ast.ClassDef | ast.Assign | ast.AnnAssign


def described(directives: str) -> str:
    """Markdown for ``.. autoclass::`` and its like, with the members where they are asked for."""
    parts: list[str] = []
    for one in re.split(r"^\.\. ", directives, flags=re.MULTILINE)[1:]:
        heading, *options = one.splitlines()
        node, doc = _definition(heading.partition("::")[2].strip())
        parts += [f"## {_name(node)}", *_entry(node, doc)]
        if isinstance(node, ast.ClassDef) and ":members:" in "".join(options):
            for member, text in _documented(node.body):
                if text and not _name(member).startswith("_"):
                    parts += [f"### {node.name}.{_name(member)}", *_entry(member, text)]
    return "\n\n".join(parts)


@cache
def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text("utf-8"))


def _definition(name: str) -> tuple[Definition, str]:
    """Definition of a name, through whatever imports it; raises LookupError without one."""
    module, _, thing = name.rpartition(".")
    place = _ROOT.joinpath(*module.split("."))
    tree = _tree(place / "__init__.py" if place.is_dir() else place.with_suffix(".py"))
    for node, doc in _documented(tree.body):
        if _name(node) == thing:
            return node, doc
    for other in ast.walk(tree):
        if isinstance(other, ast.ImportFrom) and thing in [alias.name for alias in other.names]:
            return _definition(f"{other.module}.{thing}")
    raise LookupError(name)


def _documented(body: list[ast.stmt]) -> Iterator[tuple[Definition, str]]:
    """Definitions with their docstrings, which follow those of values."""
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node, ast.get_docstring(node) or ""
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            docstring = after.value if isinstance(after, ast.Expr) else None
            yield node, str(docstring.value) if isinstance(docstring, ast.Constant) else ""


def _name(node: Definition) -> str:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return node.name
    return ast.unparse(node.target if isinstance(node, ast.AnnAssign) else node.targets[0])


def _entry(node: Definition, doc: str) -> tuple[str, str]:
    call = re.sub(r"field\(default_factory=(\w+)\)", r"\1()", _call(node))
    call = textwrap.fill(call, _COLUMNS, subsequent_indent="    ", break_on_hyphens=False)
    return f"```python\n{call}\n```", _as_markdown(doc)


def _call(node: Definition) -> str:
    """How it is called, or of which type it is."""
    if isinstance(node, ast.Assign):
        return _name(node)
    if isinstance(node, ast.AnnAssign):
        return f"{_name(node)}: {ast.unparse(node.annotation)}"
    if isinstance(node, ast.ClassDef):
        return f"{node.name}({_made_of(node)})"
    returns = f" -> {ast.unparse(node.returns)}" if node.returns is not None else ""
    if any(ast.unparse(one).endswith("property") for one in node.decorator_list):
        return node.name + returns.replace(" ->", ":", 1)
    return f"{node.name}({_arguments(node)}){returns}"


def _made_of(node: ast.ClassDef) -> str:
    """Arguments of the constructor, or the fields of a record."""
    for one in node.body:
        if isinstance(one, ast.FunctionDef) and one.name == "__init__":
            return _arguments(one)
    is_record = any("dataclass" in ast.unparse(one) for one in node.decorator_list)
    fields = [ast.unparse(one) for one in node.body if isinstance(one, ast.AnnAssign)]
    return ", ".join(fields) if is_record else ""


def _arguments(node: ast.FunctionDef) -> str:
    return re.sub(r"^(self|cls)(, )?", "", ast.unparse(node.args))


def _as_markdown(doc: str) -> str:
    """Docstring as numpy writes it, as Markdown."""
    doc = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", doc).replace("::\n", ":\n")
    doc = re.sub(r"^(>>> .*?)(?=\n\n|\Z)", r"```python\n\1\n```", doc, flags=re.M | re.S)
    lines: list[str] = []
    listed = False
    for line in re.sub(r"^(\w[\w ]*)\n-{3,}$", r"§\1", doc, flags=re.M).splitlines():
        if line.startswith("§"):
            listed = line[1:] in _LISTED
            lines += [f"**{line[1:]}**", ""]
        elif listed and line and not line.startswith(" "):
            lines.append(f"- `{line}`:")
        else:
            lines.append(f"  {line.strip()}" if listed and line else line)
    return "\n".join(lines)
