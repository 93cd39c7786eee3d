"""The documents say what the program is: generated pages are up to date, and what they name exists."""

from __future__ import annotations

import importlib.util
import re
import runpy
from html import unescape
from pathlib import Path
from types import ModuleType

import pytest

from tests.docs.guide import DOCS, ROOT

PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "tests" / "validation" / "README.md",
    *sorted(DOCS.rglob("*.md")),
]
FILE = re.compile(
    r"(?<![\w/.-])(?:oilsim|coupling|booms|vessels|recordings|scenarios|tests|docs|examples)(?:/[\w.-]+)+"
)
MODULE = re.compile(
    r"(?<![\w/.-])(?:oilsim|coupling|recordings|scenarios|tests)(?:\.\w+)+"
)  # signals begin with vessels, booms
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def names_in(page: Path, pattern: re.Pattern[str]) -> set[str]:
    """Find the names that match the pattern between backticks and in code blocks."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"### One of each\n.*?(?=\n### )", "", text, flags=re.DOTALL)  # tells old names
    code = re.findall(r"```.*?```|`[^`\n]+`|^ {4}.*$|^from .*$", text, flags=re.DOTALL | re.MULTILINE)
    return {name.rstrip(".") for part in code for name in pattern.findall(part)}


def exists(dotted: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    parts = dotted.split(".")
    for length in range(len(parts), 0, -1):
        if (ROOT / Path(*parts[:length])).is_dir() or (ROOT / Path(*parts[:length])).with_suffix(".py").is_file():
            break
    if length == len(parts):
        return True
    try:
        value: object = importlib.import_module(".".join(parts[:length]))
    except ImportError:
        return False
    for part in parts[length:]:
        if not hasattr(value, part):
            return False
        value = getattr(value, part)
    return True


def script(path: Path) -> ModuleType:
    """A script of the documents as a module."""
    specification = importlib.util.spec_from_file_location(path.stem, path)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if page.name != "CHANGELOG.md"],  # which names what is gone
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_files_and_modules_exist(page: Path) -> None:
    missing = {name for name in names_in(page, FILE) if not (ROOT / name).exists()}
    missing |= {
        name for name in names_in(page, MODULE) if not (exists(name) or (ROOT / name).exists() or name.endswith(".md"))
    }
    assert missing == set(), f"{page.name} names what is not there"


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_beside_the_site_exist(page: str) -> None:
    links = {link for link in LINK.findall((ROOT / page).read_text(encoding="utf-8")) if "://" not in link}
    assert links
    assert {link for link in links if not (ROOT / link).exists()} == set()


# lines of pages that are read in an evening
LIMITS = {
    "README.md": 120,
    "CONTRIBUTING.md": 120,
    "docs/numerics.md": 290,
    "docs/losses.md": 130,
    "docs/window.md": 140,
    "docs/known-errors.md": 130,
    "docs/tried.md": 150,
}


@pytest.mark.parametrize("page", LIMITS)
def test_pages_stay_short(page: str) -> None:
    assert len((ROOT / page).read_text(encoding="utf-8").splitlines()) < LIMITS[page]


def test_pages_are_few() -> None:
    """At most ten pages say how it works and what to trust; the others are guides, reference and the start."""
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    chapters = nav[nav.index("  - How it works:") : nav.index("  - Reference:")]
    assert len(re.findall(r"\.md$", chapters, flags=re.MULTILINE)) <= 10


def test_page_of_commands_is_up_to_date() -> None:
    written = script(DOCS / "reference" / "commands.py").commands_page() + "\n"
    assert (DOCS / "reference" / "commands.md").read_text(encoding="utf-8") == written, (
        "run python docs/reference/commands.py"
    )


def test_picture_of_the_architecture_is_up_to_date() -> None:
    packages, between = runpy.run_path(str(DOCS / "architecture.py"), run_name="architecture")["read_packages"]()
    picture = unescape((DOCS / "architecture.svg").read_text(encoding="utf-8"))
    shown = set(re.findall(r"<g id=\"([\w.>]+)\"", picture))
    rooms = {f"{name}.{room}" for name, package in packages.items() for room in package.rows}
    arrows = {
        f"{name}.{a}>{b}" for name, package in packages.items() for a, ends in package.arrows.items() for b in ends
    }
    wanted = rooms | arrows | {f"{a}>{b}" for a, b in between}
    own = {name for name in shown if name.split(".")[0].split(">")[0] in packages}
    assert own == wanted, "run python docs/architecture.py"
