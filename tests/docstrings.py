"""Check that the public docstrings of the six packages tell a reader enough.

Run `python -m tests.docstrings [PATH ...]`: it prints one line a fault, as file:line, name and reason, then the count, and exits with 1
if there is a fault. ruff's pydocstyle rules check the form (punctuation, quotes, blank lines, missing docstrings); this script checks
the content:

missing     Every public module, class, function and method has a docstring. A name is public if no part of its path starts with an
            underscore. Dunder methods and the setters of a property need none: the class or the getter speaks for them.
opening     A docstring opens with a capital letter, a digit or code in backquotes, and not with one of the words in `FRAGMENTS`, which
            open a relative clause or half a sentence. A function's or method's docstring opens with a verb in the imperative, one of
            `VERBS`; extend that list if a good sentence needs it. Modules, classes and properties may open with a noun: they name
            a thing.
            A docstring has at least three words and does not only repeat its name.
arrays      A function that takes or returns float arrays gives a shape, as (N, 3), (3,) or "scalar", and a unit, as [m], [-] or one of
            the words in `DIMENSIONLESS`. Arrays of integers or booleans need a shape only. Arrays are found by their annotations,
            aliases included; in a compiled kernel, every parameter that the body indexes counts as a float array. A kernel's docstring
            also names each of its array parameters. For methods and fields, the class's or the module's docstring may give both.
errors      A function that raises ValueError, TypeError or an exception of the project names it. For methods the class's docstring may
            do so; errors of `__init__` and `__post_init__` belong in the class's docstring. Errors raised in functions that are called
            do not count.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = ("oilsim", "coupling", "vessels", "booms", "recordings", "scenarios")

_FRAGMENTS = """
what whatever which whichever who whoever whose whom where wherever when whenever why how whether those that such nobody nothing of as
like than for from with without to in on at by if and or but because since
"""
_VERBS = """
accept account accumulate act add adjust advance allocate allow announce answer append apply approximate assemble assign attach average
balance begin bind blend bound bring broadcast build calculate call cap carry change charge check choose classify clear close collect
color combine compare compile complete compute connect construct continue convert copy count couple cover create cut debrief declare decode
decrease define delete derive describe design detach detect determine differentiate discard disconnect distribute divide do double drag draw
drop emit empty encode end enforce enter enumerate erase estimate evaluate examine exchange execute exit expand explain export express
extend extract extrapolate fail fill filter find finish fit flag flush follow forget form format free freeze gather generate get give go
grade group grow guess handle hash hold identify ignore import increase inform initialize insert integrate interpolate intersect
introduce invert iterate join judge keep label lay lead leave let limit link list load locate lock log look loop lower make map mark
match measure merge mesh mirror move multiply name nest normalize note notify observe obtain offer open order orient paint pair parse pass
pause perform pick place plan plot point predict prepare prescribe preserve print process produce project propose provide publish pull
push put raise read rebuild recompute record reduce refer refine refresh refuse register reject relax release remember remove rename
render repair repeat replace replay report represent request require reserve reset resolve restore restrict resume return reuse reverse
rotate round run sample satisfy save say scale scan schedule score search select send separate serialize serve set share shift shorten
show shut sign simulate skip slice smooth solve sort span split spread stack start state step stop store structure style subtract
suggest sum supply support switch take taper tell terminate test tie time trace track transfer transform translate transmit transpose
truncate try turn unpack update use validate verify visit wait wake walk warn watch weight wrap write yield
"""
FRAGMENTS, VERBS = frozenset(_FRAGMENTS.split()), frozenset(_VERBS.split())
DIMENSIONLESS = re.compile(
    r"\b(dimensionless|ids?|index|indices|mask|masks|flags?|quaternions?|xyzw|unit vectors?|unit normals?|RGBA?|colou?rs?|bytes"
    r"|degrees|matrix of rotation|rotation matri(x|ces)|in (its|their|the variable's) unit)\b"
)
_LENGTH = r"(?:(?:\d+ )?[A-Za-z]\w*|\d+)(?: ?[-+*] ?\w+)*"
SHAPE = re.compile(rf"\((?!\w+, (?:19|20)\d\d\)){_LENGTH},(?: ?{_LENGTH})*(?:, ?{_LENGTH})*\)|\bscalars?\b")
UNIT = re.compile(
    r"\[[-1%]\]|\[[^\[\]]*\b(?:kg|m\d?|s\d?|N|Pa|J|W|K|rad|deg|degrees|kn|l|t|Hz|pixels?|bytes|steps?)\b[^\[\]]*\]"
)
FLOAT_ARRAY = re.compile(
    r"np\.float\d+|np\.floating|np\.double|np\.complex|\bArrayLike\b|np\.ndarray|\bNDArray\[Any\]|np\.number"
)
ANY_ARRAY = re.compile(r"\bNDArray\b|\bArrayLike\b|np\.ndarray")
KERNEL = re.compile(r"\b(njit|jit|vectorize|guvectorize|kernel|inlined|compiled)\b")
OWN_ERRORS = frozenset({"ValueError", "TypeError"})

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Fault:
    """One thing that a docstring lacks."""

    path: str
    line: int
    name: str
    reason: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.name}: {self.reason}"


def faults(paths: list[Path]) -> Iterator[Fault]:
    """Yield the faults of all public docstrings in these Python files, in the order of the files."""
    errors = OWN_ERRORS | _project_errors()
    for path in paths:
        relative = path.relative_to(ROOT) if path.is_relative_to(ROOT) else Path(path.name)
        if all(part == "__init__.py" or not part.startswith("_") for part in relative.parts):
            yield from _Module(relative.as_posix(), ast.parse(path.read_text(encoding="utf-8")), errors).faults()


def source_files(*names: str) -> list[Path]:
    """List the Python files under these paths of the repository, sorted."""
    found: list[Path] = []
    for name in names:
        place = ROOT / name
        found += sorted(place.rglob("*.py")) if place.is_dir() else [place]
    return found


class _Module:
    """The public docstrings of one module; `errors` are the exceptions that must be named."""

    def __init__(self, path: str, tree: ast.Module, errors: frozenset[str]) -> None:
        self.path, self.tree, self.errors = path, tree, errors
        self.text = ast.get_docstring(tree) or ""
        self.float_names, self.array_names = _aliases(tree)

    def faults(self) -> Iterator[Fault]:
        name = Path(self.path).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
        if not self.text:
            yield Fault(self.path, 1, name, "has no docstring")
        else:
            yield from self._opening(1, name, self.text, is_function=False)
        for node in self.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                yield from self._class(node)
            elif isinstance(node, Function) and not node.name.startswith("_"):
                yield from self._function(node, node.name, "")

    def _class(self, node: ast.ClassDef) -> Iterator[Fault]:
        text = ast.get_docstring(node) or ""
        if not text:
            yield Fault(self.path, node.lineno, node.name, "has no docstring")
        else:
            yield from self._opening(node.lineno, node.name, text, is_function=False)
        fields = [
            one.annotation
            for one in node.body
            if isinstance(one, ast.AnnAssign) and not ast.unparse(one.target).startswith("_")
        ]
        yield from self._arrays(node.lineno, node.name, fields, f"{_field_texts(node)}\n{text}\n{self.text}")
        for member in node.body:
            if not isinstance(member, Function):
                continue
            if member.name in ("__init__", "__post_init__", "__call__"):
                yield from self._raised(member, f"{node.name}.{member.name}", text + (ast.get_docstring(member) or ""))
            elif not member.name.startswith("_") and not _decorated(member, "setter", "overload"):
                yield from self._function(member, f"{node.name}.{member.name}", f"{text}\n{self.text}")

    def _function(self, node: Function, name: str, around: str) -> Iterator[Fault]:
        text = ast.get_docstring(node) or ""
        if not text:
            yield Fault(self.path, node.lineno, name, "has no docstring")
            return
        is_property = _decorated(node, "property", "cached_property")
        yield from self._opening(node.lineno, name, text, is_function=not is_property)
        yield from self._raised(node, name, text + around)
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
        if _is_kernel(node):
            indexed = _indexed(node)
            arrays = [one.arg for one in arguments if one is not None and one.annotation is None and one.arg in indexed]
            yield from self._kernel_arrays(node.lineno, name, arrays, text)
        annotations = [one.annotation for one in arguments if one is not None and one.annotation is not None]
        yield from self._arrays(node.lineno, name, [*annotations, *filter(None, [node.returns])], f"{text}\n{around}")

    def _opening(self, line: int, name: str, text: str, *, is_function: bool) -> Iterator[Fault]:
        words = re.findall(r"[^\s]+", text)
        first = words[0].strip("`.,:;!?").lower()
        if first in FRAGMENTS:
            yield Fault(self.path, line, name, f"opens with {words[0]!r}, a fragment")
        elif is_function and first not in VERBS:
            yield Fault(
                self.path, line, name, f"opens with {words[0]!r}, which is no verb in the imperative that is known here"
            )
        elif not re.match(r"[A-Z0-9`]", text):
            yield Fault(self.path, line, name, f"opens with {words[0]!r}, which is no capital letter")
        own = name.rpartition(".")[2].lower().replace("_", "")
        if len(words) < 3 or re.sub(r"\W+", "", text).lower().replace("_", "") == own:
            yield Fault(self.path, line, name, "says no more than its name")

    def _arrays(self, line: int, name: str, annotations: list[ast.expr], text: str) -> Iterator[Fault]:
        written = " ".join(ast.unparse(one) for one in annotations)
        words = set(re.findall(r"\w+", written))
        if not (ANY_ARRAY.search(written) or words & self.array_names):
            return
        if not SHAPE.search(text):
            yield Fault(self.path, line, name, "takes or returns an array and gives no shape, as (N, 3)")
        is_float = FLOAT_ARRAY.search(written) or words & self.float_names
        if is_float and not (UNIT.search(text) or DIMENSIONLESS.search(text)):
            yield Fault(self.path, line, name, "takes or returns an array of numbers and gives no unit, as [m]")

    def _kernel_arrays(self, line: int, name: str, arrays: list[str], text: str) -> Iterator[Fault]:
        if not arrays:
            return
        if not SHAPE.search(text):
            yield Fault(self.path, line, name, "is a kernel that indexes arrays and gives no shape, as (N, 3)")
        if not (UNIT.search(text) or DIMENSIONLESS.search(text)):
            yield Fault(self.path, line, name, "is a kernel that indexes arrays and gives no unit, as [m]")
        unnamed = [one for one in arrays if not re.search(rf"\b{one}\b", text)]
        if unnamed:
            yield Fault(self.path, line, name, f"is a kernel that does not name its array(s) {', '.join(unnamed)}")

    def _raised(self, node: Function, name: str, text: str) -> Iterator[Fault]:
        found = {error for error in _raised_names(node) if error in self.errors}
        for error in sorted(found):
            if not re.search(rf"\b{error}\b", text):
                yield Fault(self.path, node.lineno, name, f"raises {error} and does not name it")


@cache
def _project_errors() -> frozenset[str]:
    """Names of all exception classes that the six packages define, warnings left out."""
    found: dict[str, set[str]] = {}
    for path in source_files(*PACKAGES):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, set()).update(ast.unparse(base).rpartition(".")[2] for base in node.bases)
    errors = {"Exception", "RuntimeError", "ValueError", "TypeError", "OSError", "LookupError", "ArithmeticError"}
    own: set[str] = set()
    while more := {name for name, bases in found.items() if bases & (errors | own)} - own:
        own |= more
    return frozenset(name for name in own if not name.startswith("_"))


def _aliases(tree: ast.Module) -> tuple[set[str], set[str]]:
    """Names that the module gives to array types: those of floats, and all; imported aliases count by their name."""
    floats, arrays = {"Real", "Double"}, {"Real", "Double"}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            written = ast.unparse(node.value)
            if ANY_ARRAY.search(written) and "[" in written:
                arrays.add(node.targets[0].id)
                if FLOAT_ARRAY.search(written):
                    floats.add(node.targets[0].id)
    return floats, arrays


def _field_texts(node: ast.ClassDef) -> str:
    """The strings that stand below the fields of a class and document them."""
    strings = (one.value for one in node.body if isinstance(one, ast.Expr))
    return "\n".join(str(one.value) for one in strings if isinstance(one, ast.Constant))


def _decorated(node: Function, *names: str) -> bool:
    return any(ast.unparse(one).rpartition(".")[2].split("(")[0] in names for one in node.decorator_list)


def _is_kernel(node: Function) -> bool:
    return any(KERNEL.search(ast.unparse(one)) for one in node.decorator_list)


def _indexed(node: Function) -> set[str]:
    """Names that the body indexes or whose length it takes."""
    found: set[str] = set()
    for one in ast.walk(node):
        if isinstance(one, ast.Subscript) and isinstance(one.value, ast.Name):
            found.add(one.value.id)
    return found


def _raised_names(node: ast.AST) -> Iterator[str]:
    """Names of the exceptions that are raised in the body itself, not in functions defined inside."""
    for one in ast.iter_child_nodes(node):
        if isinstance(one, Function | ast.Lambda | ast.ClassDef):
            continue
        if isinstance(one, ast.Raise) and one.exc is not None:
            call = one.exc.func if isinstance(one.exc, ast.Call) else one.exc
            yield ast.unparse(call).rpartition(".")[2]
        yield from _raised_names(one)


def main(arguments: list[str]) -> int:
    """Print the faults of the files given, or of all packages; return the exit code."""
    found = list(faults(source_files(*(arguments or PACKAGES))))
    for fault in found:
        print(fault)
    print(f"{len(found)} faults")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
