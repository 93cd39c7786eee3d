"""Which tests are near a file: an import map of the code and the tests, read once from their text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from tests.mutants.mutations import Mutant, functions_around

PACKAGES = ("oilsim", "coupling", "booms", "vessels", "recordings", "scenarios")
UNASKED = (
    "docs",
    "fuzz",
    "mutants",
    "paper",
    "benchmarks",
    "regression",
)  # rooms of tests that compare texts, or take long
NEAREST = 12  # files of tests that a fault meets, unless told otherwise
COMPILING = ("njit", "inlined", "exactly_inlined")  # decorators of kernels


class ImportMap:
    """The imports of all files below a folder, by default the present one, and what follows from them."""

    def __init__(self, folder: Path = Path()) -> None:
        self._folder = folder
        roots = [folder / package for package in (*PACKAGES, "tests")]
        files = sorted(file.relative_to(folder) for root in roots for file in root.rglob("*.py"))
        self.modules = {_module(file): file for file in files}
        self.imports = {file: set(self._imported(file)) for file in files}

    def _imported(self, file: Path) -> Iterator[Path]:
        """Yield the files that a file imports; `from room import module` imports both."""
        for node in ast.walk(ast.parse((self._folder / file).read_bytes())):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            else:
                continue
            yield from (self.modules[name] for name in names if name in self.modules)

    @cached_property
    def importers(self) -> dict[Path, set[Path]]:
        """The files that import a file, by file."""
        found: dict[Path, set[Path]] = {file: set() for file in self.imports}
        for file, imported in self.imports.items():
            for one in imported:
                found[one].add(file)
        return found

    def distances(self, file: Path) -> dict[Path, int]:
        """Count the imports between a file and each that imports it, directly or not; 0 for itself."""
        reached, edge = {file: 0}, [file]
        while edge:
            edge = sorted({one for near in edge for one in self.importers[near] if one not in reached})
            steps = max(reached.values()) + 1
            reached |= dict.fromkeys(edge, steps)
        return reached

    def tests_of(self, file: Path, nearest: int = NEAREST) -> list[str]:
        """Return the nearest tests of a file: those that import or name it first, then its room's, then others that reach it."""
        room, distances = Path("tests", *file.parent.parts), self.distances(file)
        while not room.is_dir():
            room = room.parent

        def order(test: Path) -> tuple[bool, bool, int, str]:
            far = distances.get(test, 9)
            named = far < 2 or test.stem.removeprefix("test_") == file.stem
            return not named, test.parent != room, far, str(test)

        tests = {one for one in (*distances, *room.glob("test_*.py")) if one.name.startswith("test_")}
        asked = [one for one in sorted(tests, key=order) if len(one.parts) > 2 and one.parts[1] not in UNASKED]
        return [str(one) for one in asked[:nearest]]

    def stale(self, fault: Mutant) -> set[Path]:
        """Name the files whose compiled kernels a fault may change: numba does not see that what a kernel inlines has changed."""
        return {fault.file} if is_plain(fault) else set(self.distances(fault.file))


def is_plain(fault: Mutant) -> bool:
    """Tell whether a fault is in a function that Python runs, not in a compiled one or among a module's constants."""
    around = functions_around(fault)
    return bool(around) and not any(_compiled(node) for node in around)


def _module(file: Path) -> str:
    """Name the module of a file; a package by its folder."""
    return ".".join(file.parent.parts if file.name == "__init__.py" else file.with_suffix("").parts)


def _compiled(node: ast.FunctionDef) -> bool:
    """Tell whether numba compiles a function, by its decorators."""
    names = [one.func if isinstance(one, ast.Call) else one for one in node.decorator_list]
    return any(isinstance(name, ast.Name) and name.id in COMPILING for name in names)
