"""The site is built strictly: a broken link, a page outside the navigation or any other warning is an error. It opens offline."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.guide import ROOT

LOADS = re.compile(r"<(?:script|img|link|iframe|source)\b[^>]*?\b(?:src|href)=[\"']?(https?://[^\"'\s>]+)")


@pytest.mark.slow  # over 5 s; `make docs` builds as strictly, and tests of the pages look for what they name
def test_site_is_whole_and_loads_nothing_from_elsewhere(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(
        build, cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, timeout=250
    )
    assert done.returncode == 0, done.stderr
    pages = list(tmp_path.rglob("*.html"))
    assert len(pages) > 15
    foreign = {link for page in pages for link in LOADS.findall(page.read_text(encoding="utf-8"))}
    foreign |= {
        link for sheet in tmp_path.rglob("*.css") for link in re.findall(r"url\(\"?(https?://[^)]+)", sheet.read_text())
    }
    assert foreign == set()
    assert [page.name for page in pages if "<p>|" in page.read_text(encoding="utf-8")] == [], "a table is shown as text"
