"""Pages of the guide whose text lies elsewhere in the checkout, with links that lead there."""

from __future__ import annotations

import os
import re
from pathlib import Path

TEXTS = {
    "sections/contributing.md": "CONTRIBUTING.md",
    "sections/tools.md": "tools/README.md",
    "sections/resources.md": "resources/README.md",
    "sections/licences.md": "resources/LICENSES.md",
}
"""Page of the guide: file that has its text, from the root of the checkout."""

_PAGES = {text: f"docs/{page}" for page, text in TEXTS.items()} | {"README.md": "docs/index.md"}


def page_text(page: str, text: str, root: Path) -> str:
    """Text of a page as the site shows it.

    Links to a file that is a page of the site lead to that page.

    Parameters
    ----------
    page : str
        Path of the page in ``docs/``.
    text : str
        What is in it.
    root : Path
        Root of the checkout.
    """
    path = root / "docs" / page
    source = root / TEXTS[page] if page in TEXTS else path
    if source != path:
        text = source.read_text("utf-8")

    def relinked(link: re.Match[str]) -> str:
        target, mark, fragment = link[1].partition("#")
        if "://" in target or not target:
            return link[0]
        file = Path(os.path.normpath(source.parent / target))
        name = file.relative_to(root).as_posix()
        file = root / _PAGES.get(name, name)
        return f"]({Path(os.path.relpath(file, path.parent)).as_posix()}{mark}{fragment})"

    return re.sub(r"\]\(([^)\s]+)\)", relinked, text)
