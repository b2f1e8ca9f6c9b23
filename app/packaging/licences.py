"""What a bundle carries, under which licences, and whether it may be passed on.

Carried files are pairs, as PyInstaller's ``Analysis`` has them: the name in the bundle and the path
that it comes from. ``native_libraries.csv`` names the libraries that packages bring under licences
of their own.
"""

from __future__ import annotations

import csv
import functools
import importlib.metadata
import mmap
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
COMMON = Path("/usr/share/common-licenses")
"""Where Debian and its descendants have the texts of common licences."""

GPL = frozenset({"GPL-2.0-or-later", "GPL-3.0-or-later", "GPL-3.0-only"})
APART = frozenset({"AFL-2.1", "LicenseRef-Intel-Simplified", "OpenSSL"})
"""May be passed on, but on conditions that the GPL forbids: never linked with a part under it."""
FREE = frozenset((HERE / "passed_on.txt").read_text("utf-8").splitlines())
"""May be passed on together with parts under the GPL's version 3; as packages write them."""
CORRECTED = {
    # Classifiers leave out the exception, and which of the two the carried hooks are under.
    "pyinstaller": "GPL-2.0-or-later WITH Bootloader-exception",
    "pyinstaller-hooks-contrib": "Apache-2.0",
}
GNU = {
    "GPL-2.0": ("GENERAL PUBLIC LICENSE Version 2, June 1991", "OTHER PARTY WHO MAY MODIFY AND/OR"),
    "GPL-3.0": ("GNU GENERAL PUBLIC LICENSE Version 3, 29", "Interpretation of Sections 15 and 16"),
    "LGPL-2.1": ("LESSER GENERAL PUBLIC LICENSE Version 2.1, Feb", "REDISTRIBUTE THE LIBRARY AS"),
    "LGPL-3.0": ("LESSER GENERAL PUBLIC LICENSE Version 3, 29 June", "choose that version for the"),
}
"""Words from the beginning and the end of each text that has to be passed on."""

_MISSING = """\
The notices of these libraries are in none of the packages that bring them. Add them to this file,
from where their source is, before you pass the folder on:
"""

Carried = Iterable[tuple[str, str]]
Imports = Callable[[str], set[str]]


class Refused(SystemExit):
    """A bundle that would break a licence, or one whose licences are not known."""


@dataclass(frozen=True, order=True)
class Component:
    """Part of a bundle under a licence of its own; its notice has the words ``text`` in it."""

    name: str
    version: str
    licence: str
    source: str
    text: str = ""


Parts = dict[Component, set[str]]
"""The components of a bundle and the files of each."""
Users = dict[Component, set[str]]
"""Packages, or files that are of none, that are linked to a component."""


def allowed(licence: str, among: frozenset[str]) -> bool:
    """Whether an expression of SPDX can be met with these licences only."""
    while group := re.search(r"\(([^()]*)\)", licence):
        met = "met" if allowed(group[1], among) else "not met"
        licence = licence.replace(group[0], met)
    options = (option.split(" AND ") for option in licence.split(" OR "))
    return any(all(one.strip() in among | {"met"} for one in every) for every in options)


def place(path: str) -> str:
    """Path by which files are compared: in its real folder, by the name that is used."""
    folder, name = os.path.split(path)
    return os.path.join(real_folder(folder), name)


@functools.cache
def real_folder(folder: str) -> str:
    """A folder without links in its path; asked once, as most hold many files."""
    return os.path.realpath(folder)


@functools.cache
def owners() -> dict[str, importlib.metadata.Distribution]:
    """Every file that an installed distribution lists in its RECORD."""
    return {
        place(str(one.locate_file(file))): one
        for one in importlib.metadata.distributions()
        for file in one.files or ()
    }


@functools.cache
def of_distribution(one: importlib.metadata.Distribution) -> Component:
    """The component that a distribution is, by its metadata."""
    about = one.metadata
    name, short = about["Name"], (about.get("License") or "").strip()
    if len(short) > 80 or "\n" in short or short == "UNKNOWN":
        short = ""
    classified = [text for text in about.get_all("Classifier", []) if text.startswith("License ::")]
    last = [re.sub(r" \([^()]*\)$", "", text.rpartition(" :: ")[2]) for text in classified]
    declared = about.get("License-Expression") or " AND ".join(
        text for text in last if text not in ("DFSG approved", "OSI Approved")
    )
    urls = [text.partition(", ") for text in about.get_all("Project-URL", [])]
    links = (url for label, _, url in urls if re.match("(?i)source|repo|code|github", label))
    source = next(links, about.get("Home-page")) or f"the package {name} of the index"
    licence = CORRECTED.get(name.lower()) or declared or short or "no licence named"
    return Component(name, one.version, licence, source)


@functools.cache
def table() -> list[tuple[re.Pattern[str], dict[str, str]]]:
    """The rows of ``native_libraries.csv``."""
    with (HERE / "native_libraries.csv").open(encoding="utf-8", newline="") as file:
        return [(re.compile(row["name"]), row) for row in csv.DictReader(file)]


def holds(path: str, mark: str) -> bool:
    """Whether these words are in a file: some libraries say how they were built."""
    if not os.path.getsize(path):
        return False  # it cannot be mapped
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        return content.find(mark.encode()) >= 0


def native(name: str, path: str) -> list[dict[str, str]]:
    """The rows of the table that a carried file matches."""
    base = "" if re.search(r"\.py[cixz]?$", path) else os.path.basename(path)
    rows = (row for pattern, row in table() if pattern.fullmatch(base) or pattern.fullmatch(name))
    return [row for row in rows if not row["mark"] or holds(path, row["mark"])]


def components(carried: Carried, own: Component) -> Parts:
    """Find what a bundle consists of; refuse files that are of nothing known."""
    parts: Parts = defaultdict(set)
    unknown = []
    homes = (sysconfig.get_path("stdlib"), os.path.join(sys.base_prefix, "DLLs"))
    python = tuple(os.path.realpath(folder) + os.sep for folder in homes)
    environment = os.path.realpath(sys.prefix) + os.sep
    for name, source in carried:
        if not os.path.isabs(source):
            continue  # packages without a file, and links to what is carried
        path = place(source)
        rows, owner = native(name, path), owners().get(path)
        if owner:
            parts[of_distribution(owner)].add(path)
        elif path.startswith(python):
            rows += [row for _, row in table() if row["library"] == "Python"]
        elif path.startswith(str(ROOT) + os.sep) and not path.startswith(environment) and not rows:
            parts[own].add(path)
            continue
        for row in rows:
            version = f"in {owner.metadata['Name']} {owner.version}" if owner else "of the system"
            if row["library"] == "Python":
                version = sys.version.split()[0]
            part = Component(row["library"], version, row["licence"], row["source"], row["text"])
            parts[part].add(path)
        # What wheels bring from elsewhere lies in a folder of its own.
        foreign = os.path.dirname(path).endswith((".libs", ".dylibs"))
        if not rows and (foreign or not owner):
            unknown.append(name)
    if unknown:
        raise Refused(
            f"The bundle would carry {', '.join(sorted(unknown))}, whose licence is not known. "
            f"Expected are files of installed packages and those named in {HERE.name}/"
            "native_libraries.csv. Leave it out in the recipe, or find its licence and add a row."
        )
    return dict(parts)


def judge(parts: Iterable[Component]) -> list[Component]:
    """Refuse what may not be passed on, or not together; find the parts that are under the GPL."""
    for one in sorted(parts):
        if not allowed(one.licence, FREE | GPL | APART):
            raise Refused(
                f"The bundle would carry {one.name} ({one.version}) under “{one.licence}”. "
                f"Expected are licences of {HERE.name}/passed_on.txt, which go together with the "
                "GPL's version 3. Leave it out in the recipe, or read its licence and list that."
            )
    return sorted(one for one in parts if not allowed(one.licence, FREE | APART))


@functools.cache
def imports(path: str) -> set[str]:
    """The libraries that a file is linked to, as PyInstaller finds them."""
    from PyInstaller.depend.bindepend import get_imports

    return {place(library) for _, library in get_imports(path) if library}


def keep_apart(parts: Parts, binaries: Iterable[str], imports: Imports = imports) -> Users:
    """Tell who is linked to what is under the GPL or may not be; refuse one that is to both."""
    under = judge(parts)
    beside = [one for one in parts if not allowed(one.licence, FREE | GPL)]
    users: Users = {one: set() for one in (*under, *beside)}
    for binary in map(place, binaries):
        reached, to_do = {binary}, [binary]
        while to_do:
            new = imports(to_do.pop()) - reached
            reached |= new
            to_do += new
        touched = [one for one in users if parts[one] & reached]
        if set(touched) & set(under) and set(touched) & set(beside):
            names = " and ".join(f"{one.name} ({one.licence})" for one in touched)
            raise Refused(
                f"{binary} is linked to {names}. Expected is that nothing under the GPL is linked "
                "to what its licence forbids. Install a build of that package without one of them, "
                "or leave it out in the recipe."
            )
        owner = owners().get(binary)
        for one in touched:
            users[one].add(owner.metadata["Name"] if owner else os.path.basename(binary))
    return users


def of_system(paths: Iterable[str]) -> Iterator[tuple[str, str]]:
    """The copyright files of the Debian packages that libraries of the system are from."""
    real = {os.path.realpath(path) for path in paths}
    if not shutil.which("dpkg-query"):
        return
    # Packages from before /lib became a link to /usr/lib name their files there.
    asked = sorted(real | {path.removeprefix("/usr") for path in real})
    query = functools.partial(subprocess.run, capture_output=True, text=True, check=False)
    lines = query(["dpkg-query", "--search", *asked]).stdout.splitlines()
    packages = sorted({line.split(":")[0] for line in lines})
    for line in query(["dpkg-query", "--show", *packages]).stdout.splitlines():
        package, version = line.split("\t")
        file = Path("/usr/share/doc", package.split(":")[0], "copyright")
        if package.split(":")[0] in packages and file.is_file():
            title = f"{package} {version}, a package of the system"
            yield title, file.read_text("utf-8", "replace")


def texts(parts: Parts, common: Path = COMMON) -> dict[str, list[str]]:
    """Collect each text once, with what it is of; refuse if one that has to be there is nowhere."""
    collected: dict[str, list[str]] = defaultdict(list)
    for title, file in (
        ("SD² Studio", ROOT / "LICENSE"),
        ("resources of SD² Studio", ROOT / "resources" / "LICENSES.md"),
        ("Python", Path(sysconfig.get_path("stdlib"), "LICENSE.txt")),
    ):
        if file.is_file():
            collected[file.read_text("utf-8").strip()].append(title)
    paths = set().union(*parts.values())
    carried = {of_distribution(owners()[path]): owners()[path] for path in paths & owners().keys()}
    for part, distribution in sorted(carried.items(), key=lambda pair: pair[0].name.lower()):
        for name in distribution.files or ():
            named = "licenses" in name.parts or re.match("(?i)licen[cs]e|copying|notice", name.name)
            if named and name.suffix not in (".json", ".py", ".pyc", ".pyi", ".so"):
                text = Path(str(distribution.locate_file(name))).read_text("utf-8", "replace")
                collected[text.strip()].append(f"{part.name} {part.version}: {name.name}")
    system = [files for one, files in parts.items() if one.version == "of the system"]
    for title, text in of_system(set().union(*system)):
        collected[text.strip()].append(title)
    words = [" ".join(text.split()) for text in collected]
    needed = re.findall(r"L?GPL-\d\.\d", " ".join(one.licence for one in parts))
    # Version 2.0 of the LGPL is met as “or later” only.
    for name in sorted({name.replace("LGPL-2.0", "LGPL-2.1") for name in ("GPL-3.0", *needed)}):
        if any(all(part in text for part in GNU[name]) for text in words):
            continue
        file = common / name.removesuffix(".0")
        if not file.is_file():
            raise Refused(
                f"The text of {name} has to go with the bundle and is nowhere on this machine. "
                f"Expected is it in a carried package or as {file}. Put it there, from "
                "https://www.gnu.org/licenses/."
            )
        collected[file.read_text("utf-8").strip()].append(name)
    missing = [one for one in sorted(parts) if not any(one.text in text for text in words)]
    if missing:
        lines = [f"  - {one.name} ({one.version}): {one.source}" for one in missing]
        collected["\n".join([_MISSING, *lines])].append("NOTICES TO ADD")
    return dict(collected)


def write(file: Path, carried: Carried, binaries: Iterable[str], version: str) -> Path:
    """Write down what a bundle carries, or refuse it."""
    own = Component("SD² Studio", version, "Apache-2.0", "where this folder is from")
    parts = components(carried, own)
    under, users = judge(parts), keep_apart(parts, binaries)
    entries = {
        one: f"  - {one.name} ({one.version}): {one.licence}\n    used by {', '.join(sorted(who))}"
        for one, who in sorted(users.items())
    }
    head = (HERE / "licences_head.txt").read_text("utf-8")
    head = head.format(
        version=version,
        components=len(parts),
        under="\n".join(entries[one] for one in under) or "  - none",
        beside="\n".join(entries[one] for one in entries if one not in under) or "  - none",
    )
    rows = [
        f"{one.name} ({one.version})\n    {one.licence}\n    {one.source}" for one in sorted(parts)
    ]
    line = "=" * 80
    sections = [
        f"{line}\n{'; '.join(titles)}\n{line}\n\n{text}" for text, titles in texts(parts).items()
    ]
    file.write_text("\n\n".join([head, "COMPONENTS", *rows, "TEXTS", *sections]) + "\n", "utf-8")
    print(f"{file.name} names {len(parts)} components")
    return file
