"""Every tuned number of the fluid says its unit, meaning, origin and what it was chosen by."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parent.parent / "docs" / "constants.py"
PAGE = SCRIPT.parent / "reference" / "constants.md"


def script():
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("constants_table", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


table = script()


def test_comments_have_the_form():
    told = table.all_constants()
    wrong = [f"{one.room}:{one.line} {one.name}: {one.comment!r}" for one in told if one.parts is None]
    assert not wrong, "\n".join(wrong)
    assert {"OMEGA", "SPRAY", "EXACT", "CELL", "VOIDS", "THIRD", "STRETCH", "FURTHEST"} <= {one.name for one in told}


def test_page_is_up_to_date(capsys):
    table.main([])
    assert capsys.readouterr().out == PAGE.read_text(encoding="utf-8"), f"run python docs/constants.py > {PAGE}"


def test_table_has_a_row_for_each(capsys):
    table.main(["density", "gradients"])
    rows = capsys.readouterr().out.splitlines()
    told = [one for one in table.all_constants() if one.room.startswith(("density", "gradients"))]
    assert len(rows) == 2 + len(told)
    (omega,) = (row for row in rows if "`OMEGA`" in row)
    assert omega.split(" | ")[1:3] == ["0.2", "1"]


@pytest.mark.parametrize(
    ("source", "parts"),
    [
        ("# [m] what; measured; by whom\nA = 1.0\n", ("m", "what", "measured", "by whom")),
        ("A = np.float32(-2.0)  # [1] what; paper (X 2000); not on record\n", ("1", "what", "paper (X 2000)", "not on record")),
        ("# [1] what; measured; so\nA = 2.0 if PACKS else 1.0\n", ("1", "what", "measured", "so")),
        ("# [1] what of two\n# lines; theory; so\nA = 3.0 * float(B)\n", ("1", "what of two lines", "theory", "so")),
        ("A = 1.0  # what it is\n", None),
        ("A = 1\n", None),
        ("# [m] what; guess; so\nA = 1\n", None),
    ],
)  # fmt: skip
def test_form_is_read(tmp_path, source, parts):
    file = tmp_path / "module.py"
    file.write_text(source)
    (found,) = table.constants_of(file)
    assert found.name == "A"
    assert (None if found.parts is None else tuple(found.parts.values())) == parts


def test_what_is_no_number_needs_no_comment(tmp_path):
    file = tmp_path / "module.py"
    file.write_text("A = 'text'\nB = np.zeros(3)\nreal = 1.0\nC = True\nD = Kind.ONE\nE = F | G\nHALF = 0.5\n")
    assert not list(table.constants_of(file))
