"""What a parser takes, which `argparse` shows in its help only."""

from __future__ import annotations

import argparse


def arguments_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """Arguments and options of a parser itself, without its commands."""
    return [one for one in parser._actions if not isinstance(one, argparse._SubParsersAction)]


def options_of(parser: argparse.ArgumentParser) -> dict[str, argparse.Action]:
    """Options of a parser by all their names."""
    return {name: one for one in arguments_of(parser) for name in one.option_strings}


def groups_of(parser: argparse.ArgumentParser) -> list[str]:
    """Headings of the help, as far as there are arguments under them."""
    return [str(group.title) for group in parser._action_groups if group._group_actions]
