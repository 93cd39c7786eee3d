"""Count what the house holds: `python -m tests.house [--json] [--revision REV]`.

The counts of a plan that aims at fewer things, each once: files, lines, classes and functions of each package; modules that one other
module imports, and those of them that are small; keys of a scenario file, and those that no shipped scenario and no guide uses; checks of
modes; classes that do nothing in several methods; circles between folders; the tests and their lines. `--revision` counts another commit
of this repository by the same rules, so that a change can name its numbers before and after.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = ("oilsim", "coupling", "vessels", "booms", "recordings", "scenarios")
SMALL = 80  # lines of a module that could be a part of its only importer
# what makes a line ask for a mode of a run: particles or formulas, a window, a sea, parcels
MODE = re.compile(
    r"\b(?:has_particles|is_bare|detail\s*(?:==|!=|in)\s|(?:sea|slick|window|windows|forcing|tank|box|boxes)\s+is\s+(?:not\s+)?None"
    r"|fidelity\s*(?:==|!=|in)\s)"
)


def sources(root: Path, packages: tuple[str, ...] = PACKAGES) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each module of the packages."""
    for package in packages:
        for path in sorted((root / package).rglob("*.py")):
            name = ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
            yield name, path.read_text()


def imports_of(tree: ast.Module, modules: frozenset[str]) -> set[str]:
    """Return the modules of the house that a module imports, wherever it does so."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & modules
        elif isinstance(node, ast.ImportFrom) and node.module:
            parts = {f"{node.module}.{alias.name}" for alias in node.names} & modules
            found |= parts or ({node.module} & modules)
    return found


def circles(graph: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Return the pairs of folders that import each other; a package's own names (`__init__`) may lead into its rooms."""
    packages = {name.rpartition(".")[0] for name in graph}
    folder = {name: name if name in packages else name.rpartition(".")[0] for name in graph}
    between: dict[str, set[str]] = defaultdict(set)
    for name, targets in graph.items():
        own = f"{name}." if name in packages else "\0"
        between[folder[name]] |= {folder[target] for target in targets if not target.startswith(own)} - {folder[name]}
    return sorted((one, other) for one in between for other in between[one] if one < other and one in between[other])


def idle_methods(tree: ast.Module) -> int:
    """Count the methods that do nothing: a docstring, `pass` or an ellipsis are all that they have."""
    count = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and not any("Protocol" in ast.unparse(base) for base in node.bases):
            for method in node.body:
                if isinstance(method, ast.FunctionDef):
                    count += all(
                        isinstance(line, ast.Pass)
                        or (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant))
                        for line in method.body
                    )
    return count


def names_in(text: str) -> set[str]:
    """Return the words that a text has for keys: before a sign of equality, in a table's head, or on the way to a key, and for options."""
    written = (
        set(re.findall(r"--([a-z]+)", text))
        | set(re.findall(r"\b([a-z][a-z_0-9]*)\s*=", text))
        | set(re.findall(r"[a-z_]+", " ".join(re.findall(r"\[[\w.-]+\]|\b[\w.-]+(?=\s*=)", text))))
    )
    return written | {re.sub(r"_(kn|deg|compass)$", "", name) for name in written}


def keys_of_files(root: Path) -> tuple[int, int, int, int]:
    """Count sections and keys that a scenario file may have, the keys that no shipped scenario names, and of these those in no guide."""
    sections = keys = 0
    unused = []
    shipped = names_in("\n".join(path.read_text() for path in (root / "scenarios").rglob("*.toml")))
    pages = [
        path for path in (root / "docs").rglob("*") if path.suffix in (".md", ".toml") and path.name != "scenarios.md"
    ]
    guided = shipped | names_in("\n".join(path.read_text() for path in pages))
    for _, text in sources(root, ("scenarios",)):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ClassDef) and any(
                re.search(r"(Section|Settings)$", ast.unparse(b)) for b in node.bases
            ):
                fields = [
                    line.target.id
                    for line in node.body
                    if isinstance(line, ast.AnnAssign)
                    and isinstance(line.target, ast.Name)
                    and "ClassVar" not in ast.unparse(line.annotation)
                ]
                sections, keys = sections + 1, keys + len(fields)
                unused += [name for name in fields if name not in shipped]
    return sections, keys, len(unused), sum(name not in guided for name in unused)


def count(root: Path) -> dict[str, object]:
    """Count everything in a work tree."""
    texts = dict(sources(root))
    trees = {name: ast.parse(text) for name, text in texts.items()}
    modules = frozenset(texts)
    graph = {name: imports_of(tree, modules) for name, tree in trees.items()}
    importers = Counter(target for targets in graph.values() for target in targets)
    lines = {name: text.count("\n") for name, text in texts.items()}
    single = [name for name in modules if importers[name] == 1]
    nodes = [node for tree in trees.values() for node in ast.walk(tree)]
    sections, keys, unused, unguided = keys_of_files(root)
    tests = dict(sources(root, ("tests",)))
    return {
        "lines": sum(lines.values()),
        "lines by package": {
            package: sum(n for name, n in lines.items() if name.split(".")[0] == package) for package in PACKAGES
        },
        "files": len(modules),
        "classes": sum(isinstance(node, ast.ClassDef) for node in nodes),
        "functions": sum(isinstance(node, ast.FunctionDef) for node in nodes),
        "modules with one importer": len(single),
        f"of these up to {SMALL} lines": sum(lines[name] <= SMALL for name in single),
        "checks of modes": sum(len(MODE.findall(text)) for text in texts.values()),
        "methods that do nothing": sum(map(idle_methods, trees.values())),
        "circles between folders": len(circles(graph)),
        "sections of a scenario file": sections,
        "keys of a scenario file": keys,
        "keys in no shipped scenario": unused,
        "of these in no guide": unguided,
        "files of tests": len(tests),
        "lines of tests": sum(text.count("\n") for text in tests.values()),
        "lines of docs": sum(path.read_text().count("\n") for path in (root / "docs").rglob("*.md")),
    }


def count_revision(revision: str) -> dict[str, object]:
    """Count a commit of this repository."""
    archive = subprocess.run(["git", "-C", str(ROOT), "archive", revision], check=True, capture_output=True).stdout
    with tempfile.TemporaryDirectory() as folder, tarfile.open(fileobj=BytesIO(archive)) as tar:
        tar.extractall(folder, filter="data")
        return count(Path(folder))


def main(arguments: list[str]) -> int:
    """Print the counts, of this tree or beside those of a revision."""
    parser = argparse.ArgumentParser(prog="python -m tests.house", description="Count what the house holds.")
    parser.add_argument(
        "--revision", metavar="REV", help="print the counts of this commit too, in a column of their own"
    )
    parser.add_argument("--json", action="store_true", help="print the counts as JSON")
    options = parser.parse_args(arguments)
    found = [count(ROOT)] if options.revision is None else [count_revision(options.revision), count(ROOT)]
    if options.json:
        print(json.dumps(found[-1], indent=1))
        return 0
    for name in found[0]:
        print(f"{name:32s}" + "  ".join(f"{one[name]!s:>12s}" for one in found))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
