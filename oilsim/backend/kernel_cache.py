"""Keep compiled kernels for as long as the source that they were compiled from, in whatever checkout.

numba takes a compiled function from its cache if the file that defines the function is the same. But a kernel holds the kernels that it
calls, and the constants that it reads, from other files. Here the stamp of a file covers all modules of the six packages that it imports,
directly or through others: a change in any of them compiles anew what depends on it, and nothing else. numba adds its own version and the
processor. Under NUMBA_CACHE_DIR a file's name is made of module, function and stamp, not of the path of the checkout, so that clones share
what they compile.
"""

from __future__ import annotations

import hashlib
import re
from functools import cache
from pathlib import Path

from numba import config
from numba.core.caching import CacheImpl, InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator

PACKAGES = ("oilsim", "coupling", "vessels", "booms", "recordings", "scenarios")
_IMPORT = re.compile(r"^\s*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+([\w.]+))", re.MULTILINE)


def module_of(file: Path) -> tuple[Path, str] | None:
    """Return the folder that holds a file's package, and the dotted name of its module; None for a file of no package of ours."""
    parts = [file.stem]
    folder = file.parent
    while (folder / "__init__.py").exists():
        parts.insert(0, folder.name)
        folder = folder.parent
    return (folder, ".".join(parts)) if parts[0] in PACKAGES and len(parts) > 1 else None


def source_stamp(file: Path) -> str:
    """Return a hash of the text of a module of the packages, and of all of their modules that it imports, directly or through others."""
    found = module_of(file)
    assert found is not None, f"{file} is no module of the packages"
    root, name = found
    reached, left = set[str](), [name]
    while left:
        module = left.pop()
        if module not in reached:
            reached.add(module)
            left += _read(root, module)[1]
    return hashlib.sha256("".join(f"{one} {_read(root, one)[0]}\n" for one in sorted(reached)).encode()).hexdigest()


@cache
def _read(root: Path, module: str) -> tuple[str, tuple[str, ...]]:
    """Return the hash of a module's text, and the names of the modules of the packages that it imports."""
    path = _path(root, module)
    text = "" if path is None else path.read_text()
    names = set[str]()
    for source, taken, plain in _IMPORT.findall(text):
        if plain:
            names.add(plain)
        else:
            names |= {source, *(f"{source}.{one.split()[0]}" for one in taken.strip("()").split(",") if one.strip())}
    ours = (one for one in names if one.split(".")[0] in PACKAGES and _path(root, one) is not None)
    return hashlib.sha256(text.encode()).hexdigest(), tuple(sorted(ours))


def _path(root: Path, module: str) -> Path | None:
    """Return the file of a module, or of a package; None if there is none."""
    place = root.joinpath(*module.split("."))
    return next((one for one in (place.with_suffix(".py"), place / "__init__.py") if one.exists()), None)


class _BySources:
    """Stamps files of the packages by all that they are compiled from, and leaves other files to numba."""

    _py_file: str

    @classmethod
    def from_function(cls, py_func: object, py_file: str) -> object:
        """Return a locator for a function of this file; None where this kind has no place for it, or the file is none of ours."""
        return None if module_of(Path(py_file)) is None else super().from_function(py_func, py_file)  # type: ignore[misc]

    def get_source_stamp(self) -> str:
        """Return the stamp of the function's file."""
        return source_stamp(Path(self._py_file))


class InGivenFolder(_BySources, UserProvidedCacheLocator):
    """Keeps kernels under NUMBA_CACHE_DIR, in a folder named after their package."""

    def get_cache_path(self) -> str:
        """Return the folder of the function's package."""
        found = module_of(Path(self._py_file))
        assert found is not None
        return str(Path(config.CACHE_DIR, found[1].rpartition(".")[0]))

    def get_disambiguator(self) -> str:
        """Return what tells a function from others of its name, and from itself in a clone of other source that runs at the same time."""
        return f"{super().get_disambiguator()}-{self.get_source_stamp()[:12]}"


class InTree(_BySources, InTreeCacheLocator):
    """Keeps kernels beside their source."""


class UserWide(_BySources, UserWideCacheLocator):
    """Keeps kernels in the user's cache, where the source may not be written to."""


def install() -> None:
    """Let numba keep the kernels of the packages by their sources."""
    CacheImpl._locator_classes[:0] = [InGivenFolder, InTree, UserWide]
