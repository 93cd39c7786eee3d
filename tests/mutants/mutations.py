"""Small faults that a line of Python may have: a wrong sign, a wrong comparison, the lesser for the greater, a number off by a tenth."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"), ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
PAIRS = (("min", "max"), ("sin", "cos"), ("minimum", "maximum"), ("floor", "ceil"), ("any", "all"))
NAMES = dict(PAIRS) | {second: first for first, second in PAIRS}


class Mutant(NamedTuple):
    """One fault: lines and columns of the text that `after` replaces (columns in UTF-8 bytes, as ast counts them)."""

    file: Path
    line: int
    start: int
    end: int
    after: str

    def apply(self) -> str:
        """Return the file's text with the fault in it."""
        lines = self.file.read_bytes().split(b"\n")
        row = lines[self.line - 1]
        lines[self.line - 1] = row[: self.start] + self.after.encode() + row[self.end :]
        return b"\n".join(lines).decode()

    def __str__(self) -> str:
        """Name the place, and the line as it was and as it is with the fault."""
        before = self.file.read_bytes().split(b"\n")[self.line - 1]
        mutated = before[: self.start] + b" >>" + self.after.encode() + b"<< " + before[self.end :]
        return f"{self.file}:{self.line}: {mutated.decode().strip()}"


def mutants_of(file: Path) -> Iterator[Mutant]:
    """Yield the faults that can be put into a file: in what it computes, not in its annotations, docstrings and messages."""
    text = file.read_bytes()
    rows = text.split(b"\n")
    for node in _computing(ast.parse(text)):
        if isinstance(node, ast.BinOp | ast.Compare | ast.BoolOp):
            yield from _operator(file, rows, node)
        elif isinstance(node, ast.Name | ast.Attribute):
            name = node.id if isinstance(node, ast.Name) else node.attr
            if name in NAMES and node.end_col_offset is not None and node.end_lineno is not None:
                yield Mutant(file, node.end_lineno, node.end_col_offset - len(name), node.end_col_offset, NAMES[name])
        elif isinstance(node, ast.Constant) and type(node.value) is float and node.value != 0.0:
            yield Mutant(file, node.lineno, node.col_offset, node.end_col_offset or 0, repr(1.1 * node.value))
        elif (
            isinstance(node, ast.UnaryOp)
            and isinstance(node.op, ast.USub)
            and not isinstance(node.operand, ast.Constant)
        ):
            yield Mutant(file, node.lineno, node.col_offset, node.col_offset + 1, "+")


def functions_around(fault: Mutant) -> list[ast.FunctionDef]:
    """Return the functions in whose bodies a fault is, the outermost first."""
    around = [
        node for node in ast.walk(ast.parse(fault.file.read_bytes()))
        if isinstance(node, ast.FunctionDef) and node.body[0].lineno <= fault.line <= (node.end_lineno or 0)
    ]  # fmt: skip
    return sorted(around, key=lambda node: node.lineno)


def _computing(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree that compute: annotations, and what is raised or said, are left out."""
    for name, value in ast.iter_fields(tree):
        if name in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST) and not isinstance(
                node, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom
            ):
                yield node
                yield from _computing(node)


def _operator(file: Path, rows: list[bytes], node: ast.BinOp | ast.Compare | ast.BoolOp) -> Iterator[Mutant]:
    """Yield the fault of an operator that stands on one line between its two operands."""
    if isinstance(node, ast.BinOp):
        left, right, operator = node.left, node.right, node.op
    elif isinstance(node, ast.Compare):
        left, right, operator = node.left, node.comparators[0], node.ops[0]  # type: ignore[assignment]
    else:
        left, right, operator = node.values[0], node.values[1], node.op  # type: ignore[assignment]
    written = OPERATORS.get(type(operator))
    if written is None or left.end_lineno != right.lineno or left.end_col_offset is None:
        return
    between = rows[right.lineno - 1][left.end_col_offset : right.col_offset]
    place = between.find(written[0].encode())
    if place >= 0:
        start = left.end_col_offset + place
        yield Mutant(file, right.lineno, start, start + len(written[0]), written[1])
