"""Every command and snippet of the README and of the guide runs, in order, as typed.

All blocks of a page share one fresh folder, one shell and one namespace of Python. What a page may
say of its blocks is in CONTRIBUTING.md.
"""

from __future__ import annotations

import io
import os
import shutil
import signal
import subprocess
import sys
import traceback
from contextlib import redirect_stdout
from pathlib import Path

import pytest
from guide_pages import REPOSITORY, Block, Page, pages_to_follow

from sd2core.numerics.compiled import cache_directory

pytestmark = [
    pytest.mark.skipif(
        os.name == "nt" or shutil.which("bash") is None, reason="the blocks are run by bash"
    ),
    # Warnings are for the reader of a page to see, as at home.
    pytest.mark.filterwarnings("default"),
]

_NO_WINDOW = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
_TAIL_LINES = 25
_FAULTS = ("Traceback (most recent call last)", "Exception ignored")
"""What Python prints of an error that nobody caught, and which may leave the exit code at 0."""
_SLOW_S, _QUICK_S = 1800, 300

# What a block leaves in its shell (folder, variables) is there in the next one.
_SHELL = """
set -eE
state=$1 block=$2
if [ -f "$state/variables" ]; then . "$state/variables"; cd "$PWD"; fi
trap 'code=$?; export -p > "$state/variables"; exit $code' EXIT
trap 'echo "$LINENO $BASH_COMMAND" > "$state/failed"' ERR
. "$block"
"""


def as_parameter(page: Page) -> object:
    limit = pytest.mark.timeout(_SLOW_S if page.slow else _QUICK_S)
    return pytest.param(page, id=page.name, marks=(pytest.mark.slow, limit) if page.slow else limit)


@pytest.fixture
def at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Home folder of a new user, with ``sd2`` of this checkout on the path; no display."""
    import matplotlib

    kept = {"MPLCONFIGDIR": matplotlib.get_configdir()}  # its list of fonts takes seconds
    if (kernels := cache_directory()) is not None:
        kept["NUMBA_CACHE_DIR"] = str(kernels.parent)
    home, programs = tmp_path / "home", tmp_path / "programs"
    home.mkdir()
    programs.mkdir()
    script = programs / "sd2"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sd2app.command_line "$@"\n')
    script.chmod(0o755)
    python = str(Path(sys.executable).parent)
    for name, value in {
        **kept,
        "HOME": str(home),
        "XDG_CACHE_HOME": str(home / ".cache"),
        "XDG_CONFIG_HOME": str(home / ".config"),
        "XDG_DATA_HOME": str(home / ".local" / "share"),
        "PATH": os.pathsep.join([str(programs), python, os.environ["PATH"]]),
        "PYTHONPATH": os.pathsep.join([str(REPOSITORY), str(REPOSITORY / "app")]),
        "MPLBACKEND": "agg",
    }.items():
        monkeypatch.setenv(name, value)
    for name in _NO_WINDOW:
        monkeypatch.delenv(name, raising=False)
    return home


@pytest.mark.parametrize("page", [as_parameter(page) for page in pages_to_follow() if page.to_run])
def test_the_page_works_as_typed(
    page: Page,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    for name, stored in page.shared_files.items():
        original = request.getfixturevalue("shared_data") / stored
        assert original.exists(), f"{page.name} needs {original}"
        (folder / name).symlink_to(original)
    if any("sd2 fit " in block.text for block in page.to_run):
        models = request.getfixturevalue("models")
        monkeypatch.setenv("SD2_MODELS", str(models.detector.parent))
    request.getfixturevalue("at_home")
    monkeypatch.chdir(folder)
    follow(page, tmp_path)


def follow(page: Page, state: Path) -> None:
    """Run the blocks of a page in the current folder; ``state`` is another one."""
    names: dict[str, object] = {"__name__": "__main__"}
    printed = ""
    for block in page.blocks:
        if block.to_run:
            printed = (
                _run_shell(page, block, state)
                if block.language == "sh"
                else _run_python(page, block, names)
            )
        elif block.seen and (line := block.line_not_printed(printed)) is not None:
            pytest.fail(
                f"{page.name}, below line {block.line}: not printed, or not there:\n{line}\n"
                f"What was printed:\n{printed}",
                pytrace=False,
            )


def _run_shell(page: Page, block: Block, state: Path) -> str:
    """Run a block, and return what it printed."""
    text, failed = state / "block.sh", state / "failed"
    text.write_text(block.text)
    failed.unlink(missing_ok=True)
    output = state / "output"
    with output.open("w") as stream:
        shell = subprocess.Popen(
            ["bash", "-c", _SHELL, "bash", str(state), str(text)],
            stdin=subprocess.DEVNULL,
            stdout=stream,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = shell.wait()
        finally:
            if shell.poll() is None:
                os.killpg(shell.pid, signal.SIGKILL)
    said = output.read_text(errors="replace")
    if code != 0 or any(sign in said for sign in _FAULTS):
        line, _, command = (failed.read_text() if failed.exists() else "1 ").partition(" ")
        pytest.fail(
            f"{page.name}, line {block.line + int(line) - 1}: {command.strip() or block.text}\n"
            f"ended with exit code {code}:\n" + "\n".join(said.splitlines()[-_TAIL_LINES:]),
            pytrace=False,
        )
    return said


def _run_python(page: Page, block: Block, names: dict[str, object]) -> str:
    """Run a block, and return what it printed."""
    # Lines are counted as in the page, in errors as well.
    source = "\n" * (block.line - 1) + block.text
    printed = io.StringIO()
    try:
        with redirect_stdout(printed):
            exec(compile(source, page.name, "exec"), names)
    except Exception as error:
        steps = [
            one for one in traceback.extract_tb(error.__traceback__) if one.filename == page.name
        ]
        line = steps[-1].lineno if steps else getattr(error, "lineno", None)
        line = line or block.line
        pytest.fail(
            f"{page.name}, line {line}: {source.splitlines()[line - 1].strip()}\n"
            + "".join(traceback.format_exception(error)[-_TAIL_LINES:]),
            pytrace=False,
        )
    return printed.getvalue()


@pytest.mark.parametrize("page", pages_to_follow(), ids=lambda page: page.name)
def test_blocks_are_called_what_the_test_runs(page: Page) -> None:
    unseen = {"bash", "shell", "console", "zsh", "py", "python3", "pycon", "ipython"}
    before = None
    for block in page.blocks:
        place = f"{page.name}, line {block.line}"
        assert block.language not in unseen, f"{place}: sh or python"
        if block.seen:
            assert before is not None, f"{place}: what is seen comes after what is run"
            assert before.to_run, f"{place}: shows what a block prints that is not run"
        elif block.language in ("sh", "python"):
            before = block


def page_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> Page:
    monkeypatch.setattr("guide_pages.REPOSITORY", tmp_path)
    path = tmp_path / "page.md"
    path.write_text(text)
    return Page(path)


_PAGE = """\
# A page

1. Begin:

   ```sh
   export WORD=radar
   mkdir inner && cd inner
   ```

```python
from pathlib import Path
Path("made.txt").write_text("by Python")
```

<!-- not run: it would fail -->
```sh
false
```

```sh
[ "$WORD" = radar ]
grep Python ../made.txt
[ "$(basename "$PWD")" = inner ]
```

```python
assert Path("made.txt").exists()
```
"""


def test_blocks_share_folder_shell_and_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = page_of(
        tmp_path,
        monkeypatch,
        _PAGE,
    )
    folder = tmp_path / "folder"
    folder.mkdir()
    monkeypatch.chdir(folder)
    assert [block.line for block in page.blocks] == [6, 11, 17, 21, 27]
    assert [block.not_run for block in page.blocks] == ["", "", "it would fail", "", ""]
    follow(page, tmp_path)


@pytest.mark.parametrize(
    ("block", "told"),
    [
        (
            "```sh\ntrue\necho said; grep nothing /dev/null\necho after\n```",
            ["page.md, line 5: grep nothing /dev/null", "exit code 1", "said"],
        ),
        ("```sh\ntrue | false\n```", ["page.md, line 4:", "false"]),
        (
            f"```sh\n'{sys.executable}' -c 'import atexit; atexit.register(lambda: 1 / 0)'\n```",
            ["page.md, line 4:", "exit code 0", "ZeroDivisionError"],
        ),
        ("```python\nvalue = 1\nvalue / 0\n```", ["page.md, line 5: value / 0", "ZeroDivision"]),
        ("```python\nvalue = \n```", ["page.md, line 4: value =", "SyntaxError"]),
    ],
)
def test_a_failure_names_page_line_and_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: str, told: list[str]
) -> None:
    page = page_of(tmp_path, monkeypatch, f"# A page\n\n{block}\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(pytest.fail.Exception) as caught:
        follow(page, tmp_path)
    for text in told:
        assert text in str(caught.value)
    assert "after" not in str(caught.value)


@pytest.mark.parametrize(
    ("shown", "missed"),
    [
        ("size 3 m\nmade: 2.50 s", None),  # spaces do not count, lines between may be left out
        ("size …\n…\nmade: … s", None),
        ("from…\nsize 3 m", None),
        ("size 4 m", "size 4 m"),
        ("size 3", "size 3"),  # a line as a whole
        ("made: … s\nsize 3 m", "size 3 m"),  # in order
        ("size 3 m\nsize 3 m", "size 3 m"),  # each as often as shown
        ("from (a.c", "from (a.c"),  # no regular expression
    ],
)
def test_what_a_page_shows_was_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shown: str, missed: str | None
) -> None:
    shell = "```sh\necho 'from (abc)'; echo 'size   3 m' >&2; echo; echo 'made: 2.50 s'\n```"
    python = "```python\nprint('from (abc)\\nsize   3 m\\n\\nmade: 2.50 s')\n```"
    monkeypatch.chdir(tmp_path)
    for block in (shell, python):
        page = page_of(
            tmp_path, monkeypatch, f"{block}\n\nIt prints\n\n```text seen\n{shown}\n```\n"
        )
        if missed is None:
            follow(page, tmp_path)
        else:
            with pytest.raises(pytest.fail.Exception, match="below line 8") as caught:
                follow(page, tmp_path)
            assert f":\n{missed}\n" in str(caught.value)


def test_a_page_says_what_it_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs = "<!-- needs shared data: walk.npz=mesh/walk.npz\n     capture=radar/people -->\n"
    page = page_of(tmp_path, monkeypatch, f"<!-- slow: it trains -->\n{needs}# A page\n")
    assert page.slow
    assert page.shared_files == {"walk.npz": "mesh/walk.npz", "capture": "radar/people"}
    assert not page_of(tmp_path, monkeypatch, "# A slow page\n").slow
