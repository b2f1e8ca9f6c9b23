"""Run one command: exit code 0, 1 (explained in a paragraph) or 2 (usage)."""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Sequence

from sd2core.cli.command_parser import UsageError, record_of
from sd2core.cli.output import Report, discard_output
from sd2core.errors import Sd2Error, of_the_system

_STARTS_WITH_NEGATIVE_NUMBER = re.compile(r"-\.?\d")


def run(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> int:
    """Parse, call the handler, print what it reports, and turn errors into a sentence.

    With ``--json`` or ``--progress-json`` standard output has the error as well. Returns 0, or the
    handler's code; 1 for an error; 2 where the words are no command; 130 when interrupted.
    """
    flags = {"--json", "--progress-json"}.intersection(arguments)
    _take_any_output()
    try:
        options = parser.parse_args(attach_negative_values(arguments))
        from sd2core.cli.output_folders import output_folders

        with output_folders(options):
            found = options.handler(record_of(options))
            if isinstance(found, Report):
                found.print(as_json=options.json)
                found = found.code
        _flush_output()
        return found or 0
    except KeyboardInterrupt:
        from sd2core.processes import INTERRUPTED

        print("sd2: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read the output (`| head`) has seen enough.
        discard_output()
        return 0
    except Exception as error:
        if os.environ.get("SD2_TRACEBACK") == "1" and not isinstance(error, Sd2Error):
            raise
        if isinstance(error, OSError) and not error.filename and error.errno and _output_fails():
            discard_output()
            error, flags = Sd2Error(f"The output cannot be written ({error.strerror})"), set()
        explained = explanation(error)
        print(f"sd2: {explained}", file=sys.stderr)
        if flags:
            _tell_programs(explained, as_line="--json" not in flags)
        return 2 if isinstance(error, UsageError) else 1


def explanation(error: Exception) -> Sd2Error:
    """Explain any error to the user."""
    if isinstance(error, Sd2Error):
        return error
    if isinstance(error, OSError) and error.strerror:
        return of_the_system(error)
    if isinstance(error, MemoryError):
        return Sd2Error(f"There is not enough memory for this ({error})")
    if isinstance(error, UnicodeEncodeError):  # Linux takes any bytes for a name
        named = error.object[max(error.start - 20, 0) : error.end + 20]
        return Sd2Error(f"A name of a file is no UTF-8, in {named!a}", "UTF-8", "Rename that file")
    if isinstance(error, ModuleNotFoundError) and error.name == "torch":
        return Sd2Error(
            "torch is needed for this, which denoises, classifies or trains, or runs a body"
            " model in TorchScript",
            remedy='Install it: pip install "sd2-core[learn]"',
        )
    return Sd2Error(
        f"This should not happen ({type(error).__name__}: {error})",
        remedy="Please report it, with what is printed when the same command runs with"
        " SD2_TRACEBACK=1 set",
    )


def _tell_programs(error: Sd2Error, *, as_line: bool) -> None:
    from sd2core.cli.output import picked, print_event, print_json

    try:
        if as_line:
            print_event("error", text=str(error))
        else:
            print_json({"error": picked(error, "found", "expected", "remedy")})
        _flush_output()
    except OSError:
        discard_output()


def attach_negative_values(arguments: Sequence[str]) -> list[str]:
    """Turn ``--sensor -1,0,2`` into ``--sensor=-1,0,2``, which argparse does not mistake.

    No option of ``sd2`` begins with a digit, so what begins with a negative
    number is always the value of the option before it.
    """
    attached: list[str] = []
    for argument in arguments:
        before = attached[-1] if attached else ""
        if (
            _STARTS_WITH_NEGATIVE_NUMBER.match(argument)
            and before.startswith("--")
            and before != "--"
            and "=" not in before
        ):
            attached[-1] = f"{before}={argument}"
        else:
            attached.append(argument)
    return attached


def _take_any_output() -> None:
    """Let no letter that an encoding lacks end a command, and no standard error that is closed."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (for all that follows)


def _flush_output() -> None:
    if sys.stdout is not None:  # closed: `>&-`
        sys.stdout.flush()


def _output_fails() -> bool:
    """True if standard output is what could not be written: what it holds back still cannot."""
    try:
        _flush_output()
    except OSError:
        return True
    return False
