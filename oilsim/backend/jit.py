"""Compile kernels: the options that all kernels share, and a compiler that the garbage collector does not interrupt.

A module that takes `njit`, or options, from here has its kernels kept by their sources.

Keep compiled kernels for as long as the source that they were compiled from, in whatever checkout.

numba takes a compiled function from its cache if the file that defines the function is the same. But a kernel holds the kernels that it
calls, and the constants that it reads, from other files. Here the stamp of a file covers all modules of the six packages that it imports,
directly or through others: a change in any of them compiles anew what depends on it, and nothing else. numba adds its own version and the
processor. Under NUMBA_CACHE_DIR a file's name is made of module, function and stamp, not of the path of the checkout, so that clones share
what they compile.
"""

from __future__ import annotations

import gc
import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numba import config
from numba import njit as njit
from numba.core.caching import CacheImpl, InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator
from numba.core.event import Event, Listener, register
from numba.core.registry import CPUDispatcher

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


# Kernels own no arrays. numba would count references to their arguments whenever a loop hands them to a function, and threads would wait
# for each other at that count: a fifth of a product's time. C does not call kernels: a wrapper for it would only take time to compile.
FAST = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
ALLOCATING = FAST | {"_nrt": True}  # of kernels that make arrays

EXACT = FAST | {"fastmath": False}  # of kernels whose result may not depend on how a formula is rounded

INLINED = {name: option for name, option in FAST.items() if name != "cache"} | {
    "nopython": True, "forceinline": True, "no_cpython_wrapper": True,
}  # fmt: skip


class Inlined(CPUDispatcher):
    """A function that is compiled for kernels alone; Python runs it as it is written.

    A wrapper for calls from Python would take a tenth of the time to compile.
    """

    def __call__(self, *arguments: Any) -> Any:
        """Run the function as Python, without compiling it."""
        return self.py_func(*arguments)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that kernels call in such a way that it always becomes part of them.

    Left to the compiler, inlining would depend on whether the callee came from the cache, and so would the bits of results. The function is
    typed once, where numba's own inlining would do so at every call, and it takes no place in the cache.
    """
    return function if config.DISABLE_JIT else Inlined(function, targetoptions=INLINED)


def exactly_inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function as `inlined` does, but with every operation rounded as it is written; for kernels compiled with `EXACT`."""
    return function if config.DISABLE_JIT else Inlined(function, targetoptions=INLINED | {"fastmath": False})


class WithoutCollector(Listener):
    """Stops Python's garbage collector while numba compiles.

    The collector would look through the compiler's many objects again and again, which takes a quarter of the time.
    """

    def __init__(self) -> None:
        self._depth = 0  # compilations under way; only one thread at a time compiles
        self._enabled = False

    def on_start(self, event: Event) -> None:
        """Stop the collector at the first of nested compilations."""
        if self._depth == 0:
            self._enabled = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        """Start the collector again after the last of nested compilations."""
        self._depth -= 1
        if self._depth == 0 and self._enabled:
            gc.enable()


register("numba:compile", WithoutCollector())
install()


ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
TWO, THREE = np.float32(2.0), np.float32(3.0)
