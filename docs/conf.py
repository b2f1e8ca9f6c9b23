"""Settings of the guide's site; `make docs` builds it into build/docs."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

REPOSITORY = Path(__file__).resolve().parent.parent
for _folder in (REPOSITORY / "app", REPOSITORY):
    sys.path.insert(0, str(_folder))

from sd2app.command_line import full_parser  # noqa: E402
from sd2app.manual.pages import command_text, commands_of  # noqa: E402
from sd2core.version import __version__  # noqa: E402

# What the notebook's kernel keeps for itself stays out of the user's folders.
_KERNEL = REPOSITORY / "build" / "notebook"
os.environ |= {
    "IPYTHONDIR": str(_KERNEL / "ipython"),
    "JUPYTER_RUNTIME_DIR": str(_KERNEL / "runtime"),
    # Threads of small products wait for each other, and much so where other work is done.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYDEVD_DISABLE_FILE_VALIDATION": "1",
    "PYTHONPATH": os.pathsep.join([str(REPOSITORY), str(REPOSITORY / "app")]),
}

project = "SD² Studio"
author = "The SD² Studio authors"
copyright = "The SD² Studio authors, Apache License 2.0"
version = release = __version__
language = "en_GB"
smartquotes_action = "D"  # dashes only

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]

# For users and what is measured; developers read the rest in the checkout.
exclude_patterns = ["architecture.md", "decisions"]
MEASURED = "how-good-is-it"
"""Page that lists those measured, which the search leaves to that list."""

# Markdown. Links to files outside docs/ become downloads, so that they work without a network;
# one that leads nowhere is a warning, and warnings are errors.
myst_heading_anchors = 4

# The notebook is stored without outputs, and runs whenever its page is built.
nb_execution_mode = "force"
nb_execution_show_tb = True
nb_execution_timeout = 240
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # by default from the web

# Python.
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
maximum_signature_line_length = 70
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False  # "path" is no link to whatever has a path
add_module_names = False
toc_object_entries_show_parents = "hide"

# HTML: nothing is fetched from the web when it is read.
html_theme = "pydata_sphinx_theme"
html_title = "SD² Studio"
html_copy_source = False
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["guide.css"]
html_theme_options = {
    "logo": {"text": "SD² Studio"},
    "header_links_before_dropdown": 9,
    "navbar_align": "left",
    "navbar_end": ["theme-switcher"],
    "show_toc_level": 2,
    "show_prev_next": True,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_sidebars = {"index": [], "first-five-minutes": []}
copybutton_prompt_text = r">>> |\.\.\. "
copybutton_prompt_is_regexp = True


def setup(app: Sphinx) -> None:
    """Write the pages of the commands before pages are looked for, and follow the reading."""
    for variable in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        Path(os.environ[variable]).mkdir(parents=True, exist_ok=True)
    _write_command_pages(Path(app.srcdir) / "commands")
    app.connect("source-read", _unlink_what_is_left_out)
    app.connect("env-updated", _leave_measured_out_of_the_search)
    app.connect("autodoc-process-signature", _with_readable_defaults)


def _write_command_pages(folder: Path) -> None:
    """Write the pages of commands that the program's own manual has."""
    parser = full_parser()
    pages = {f"{name}.md": command_text(parser, name) for name in ("index", *commands_of(parser))}
    folder.mkdir(exist_ok=True)
    for path in set(folder.glob("*.md")) - {folder / name for name in pages}:
        path.unlink()
    for name, text in pages.items():
        path = folder / name
        # Pages that are as they were are not built again.
        if not path.is_file() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def _unlink_what_is_left_out(app: Sphinx, name: str, source: list[str]) -> None:
    left_out = r"\[([^\]]+)\]\((?:\.\./)?(?:decisions/|architecture\.md)[^)]*\)"
    source[0] = re.sub(left_out, r"\1", source[0])


def _leave_measured_out_of_the_search(app: Sphinx, env: BuildEnvironment) -> None:
    for page in env.toctree_includes.get(MEASURED, ()):
        env.metadata[page]["nosearch"] = True


def _with_readable_defaults(
    app: Sphinx, what: str, name: str, thing: object, options: object, call: str | None, result: str
) -> tuple[str | None, str]:
    """Write defaults that a dataclass makes as Python, so that Sphinx can set the line."""
    return (call.replace("<factory>", "...") if call else call), result
