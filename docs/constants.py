"""Print the constants of the fluid as a Markdown table: `python docs/constants.py [ROOM ...]`.

Without rooms it prints the page of all: `python docs/constants.py > docs/reference/constants.md`.

Every uppercase number of a module in `oilsim` has a comment of one form, on the lines before it or behind it:

    # [unit] meaning; origin; what it was chosen by

The origin is `paper`, `theory`, `measured`, `tuned` (no measurement is on record), `numerical` (it changes cost or rounding, not physics)
or `layout` (a place in an array), with a source in brackets where there is one. `d` is the particle spacing, `t_u` the unit of time of
`relaxation_time`. The text `not on record` stands where the reason is not known any more. Names that spell their value, as HALF, need no
comment. A value that depends on the processor is shown as the expression that chooses it.
"""

from __future__ import annotations

import ast
import importlib
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "oilsim"
SPELLED = {"ZERO", "HALF", "ONE", "TWO", "THREE", "FOUR", "TWENTY"}  # names that spell their value
NUMBERS = {
    "float",
    "int",
    "float32",
    "float64",
    "int64",
    "uint32",
    "tuple",
    "floor",
}  # calls that make a number of numbers
FORM = re.compile(r"\[(?P<unit>[^]]+)\] (?P<meaning>[^;]+); (?P<origin>[^;]+); (?P<chosen>[^;]+)")
ORIGINS = ("paper", "theory", "measured", "tuned", "numerical", "layout")
INTRODUCTION = """# Constants

`python docs/constants.py > docs/reference/constants.md` writes this page from the comments beside the constants of the package `oilsim`.
Settings of a fluid are no constants: see [Fluid](fluid.md).

| origin | meaning |
|---|---|
| paper | The value is in the source named. |
| theory | The value is derived; the last column says from what. |
| measured | Runs were compared; the last column gives the result. |
| tuned | The value was chosen by trial; no measurement is on record. |
| numerical | The value changes cost or rounding, not physics. |
| layout | A place in an array. |

Units: `d` is the particle spacing, `t_u` the unit of time of `oilsim.gradients.relaxation_time`. "Not on record" means that the reason for
the value is not known any more.
"""


@dataclass(frozen=True)
class Constant:
    """An uppercase number of a module, and the comment beside it."""

    file: Path
    line: int
    name: str
    comment: str
    expression: str

    @property
    def parts(self) -> dict[str, str] | None:
        """Unit, meaning, origin and reason; None where the comment has another form."""
        found = FORM.fullmatch(self.comment)
        return found.groupdict() if found and found["origin"].startswith(ORIGINS) else None

    @property
    def room(self) -> str:
        """The module, without the package's name."""
        return self.file.relative_to(PACKAGE).with_suffix("").as_posix()

    def value(self) -> str:
        """The value as it is in the module, or the expression where the processor decides."""
        if " if " in self.expression:
            return f"`{self.expression}`"
        module = importlib.import_module(".".join(self.file.relative_to(ROOT).with_suffix("").parts))
        value = getattr(module, self.name)
        return ", ".join(f"{float(number):.6g}" for number in _flat(value))


def is_number(node: ast.expr) -> bool:
    """Tell whether an expression is made of numbers and other uppercase names only."""
    match node:
        case ast.Constant(value=value):
            return isinstance(value, (int, float)) and not isinstance(value, bool)
        case ast.Name(id=name):
            return name.isupper()
        case ast.UnaryOp(operand=operand):
            return is_number(operand)
        case ast.BinOp(left=left, op=operator, right=right):
            return not isinstance(operator, ast.BitOr) and is_number(left) and is_number(right)
        case ast.IfExp(body=one, orelse=other):
            return is_number(one) and is_number(other)
        case ast.Tuple(elts=elements):
            return all(map(is_number, elements))
        case ast.GeneratorExp(generators=[ast.comprehension(iter=numbers)]):
            return is_number(numbers)
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=arguments):
            return name in NUMBERS and bool(arguments) and all(map(is_number, arguments))
    return False


def comments_of(source: str) -> dict[int, tuple[str, bool]]:
    """Return the comments by line, and whether each stands alone on it."""
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    found = (token for token in tokens if token.type == tokenize.COMMENT)
    return {t.start[0]: (t.string.lstrip("# "), t.line.lstrip().startswith("#")) for t in found}


def constants_of(file: Path) -> Iterator[Constant]:
    """Find the uppercase numbers of a module."""
    source = file.read_text()
    comments = comments_of(source)
    for node in ast.parse(source).body:
        if not (isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None and is_number(node.value)):
            continue
        names = ast.walk(node.targets[0] if isinstance(node, ast.Assign) else node.target)
        first, above = node.lineno, []
        while comments.get(first - 1, ("", False))[1]:
            first -= 1
            above.insert(0, comments[first][0])
        behind = [comments[n][0] for n in range(node.lineno, (node.end_lineno or node.lineno) + 1) if n in comments]
        for name in names:
            if isinstance(name, ast.Name) and name.id.isupper() and name.id not in SPELLED:
                yield Constant(file, node.lineno, name.id, " ".join(above or behind), ast.unparse(node.value))


def all_constants() -> list[Constant]:
    """Find the uppercase numbers of all modules of the fluid, in the order of their files."""
    return [constant for file in sorted(PACKAGE.rglob("*.py")) for constant in constants_of(file)]


def _flat(value: object) -> list[object]:
    """The numbers of nested tuples in their order, or the one number."""
    return [number for part in value for number in _flat(part)] if isinstance(value, tuple) else [value]


def main(rooms: list[str]) -> None:
    """Print the table of the named rooms, or the page of all."""
    if not rooms:
        print(INTRODUCTION)
    print("| name | value | unit | meaning | origin | chosen by | room |\n|---|---|---|---|---|---|---|")
    for constant in all_constants():
        parts = constant.parts
        if parts and (not rooms or constant.room.startswith(tuple(rooms))):
            cells = parts["unit"], parts["meaning"], parts["origin"], parts["chosen"], constant.room
            escaped = (cell.replace("|", "\\|") for cell in cells)
            print(f"| `{constant.name}` | {constant.value()} |", " | ".join(escaped), "|")


if __name__ == "__main__":
    main(sys.argv[1:])
