"""Write the page on the `oilsim` command from its argument parsers: ``python docs/reference/commands.py``."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from scenarios.cli import command_parser

PAGE = Path(__file__).with_name("commands.md")
INTRODUCTION = """# Commands

This page is written by `python docs/reference/commands.py` from the program's own argument parsers. `oilsim COMMAND --help` prints
the same in a terminal.

| exit code | meaning |
|---|---|
| 0 | The command is done. |
| 1 | The run failed, and the recording so far is kept; or a comparison found a difference. |
| 2 | The input is bad. The message says what is wrong, where, and what is allowed. |
| 130 | Ctrl-C interrupted the command. |
"""


def commands_page() -> str:
    """The whole page as Markdown."""
    parser = command_parser()
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    helps = {choice.dest: choice.help or "" for choice in commands._choices_actions}
    chapters = (_chapter(name, helps[name], command) for name, command in commands.choices.items())
    return "\n".join([INTRODUCTION, *(line for chapter in chapters for line in chapter)])


def _chapter(name: str, meaning: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    """A command: its purpose, and a row for each argument."""
    actions = [action for action in parser._actions if action.dest != "help"]
    yield f"## oilsim {name}"
    yield f"{meaning[:1].upper()}{meaning[1:]}."
    yield ""
    if actions:
        yield "| argument | meaning |"
        yield "|---|---|"
        for action in actions:
            yield f"| {_spelling(action)} | {_cell(action.help or '')} |"
        yield ""


def _spelling(action: argparse.Action) -> str:
    """The argument as it is typed."""
    choices = "|".join(map(str, action.choices)) if action.choices else ""
    value = str(action.metavar or choices or action.dest) if action.nargs != 0 else ""
    if not action.option_strings:
        return f"`[{value}]`" if action.nargs == "?" else f"`{_cell(value)}`"
    return ", ".join(f"`{_cell(' '.join(filter(None, (option, value))))}`" for option in action.option_strings)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(commands_page() + "\n", encoding="utf-8")
    print(f"wrote {PAGE}")
