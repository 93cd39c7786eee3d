"""The tester's guide is followed: each recipe is a test of this module, as it would be in a file of the reader's."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.guide import DOCS, blocks, write_files

GUIDE = DOCS / "guides" / "tester.md"
for _block in blocks(GUIDE, "python"):
    if not _block.title:
        exec(compile(_block.text, str(GUIDE), "exec"), globals())


@pytest.fixture(autouse=True)
def _in_a_folder_with_the_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_files(GUIDE, tmp_path)
    monkeypatch.chdir(tmp_path)


def test_there_are_ten_recipes() -> None:
    text = GUIDE.read_text(encoding="utf-8")
    recipes = text[text.index("## Ten recipes") : text.index("## Recordings")]
    assert [line[4:6].rstrip(".") for line in recipes.splitlines() if line.startswith("### ")] == [
        str(n) for n in range(1, 11)
    ]
