"""The public docstrings of the six packages pass `tests.docstrings`, and its rules find what they should."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docstrings import PACKAGES, faults, source_files

ARRAY = "import numpy as np\nfrom numpy.typing import NDArray\nArray = NDArray[np.float64]\n"
HEAD = '"""A module for a test."""\n'


def found(folder: Path, code: str) -> list[str]:
    file = folder / "sample.py"
    file.write_text(HEAD + code)
    return [fault.reason for fault in faults([file])]


def test_every_public_docstring_passes() -> None:
    assert [str(fault) for fault in faults(source_files(*PACKAGES))] == []


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("def f() -> int:\n    return 1\n", "has no docstring"),
        ('def f() -> int:\n    """What comes out of it."""\n', "'What', a fragment"),
        ('def f() -> int:\n    """Number of things found."""\n', "'Number', which is no verb"),
        ('def f() -> int:\n    """Blah number of things."""\n', "'Blah', which is no verb"),
        ('def f() -> int:\n    """Return f."""\n', "no more than its name"),
        ('class C:\n    """Those that are left."""\n', "'Those', a fragment"),
        (ARRAY + 'def f(x: Array) -> None:\n    """Fill x with the lengths [m]."""\n', "no shape"),
        (ARRAY + 'def f(x: Array) -> None:\n    """Fill x with the lengths (Qiu, 2021) [m]."""\n', "no shape"),
        (ARRAY + 'def f(x: Array) -> None:\n    """Fill x (N, 3) with the lengths [see there]."""\n', "no unit"),
        (
            '@njit\ndef f(x):\n    """Double the lengths (N,) [m] in place."""\n    x[0] = 2\n',
            "does not name its array(s) x",
        ),
        ('def f() -> int:\n    """Return the number of things."""\n    raise ValueError("x")\n', "raises ValueError"),
        (
            'class C:\n    """A thing of its own."""\n\n    def __init__(self) -> None:\n        raise TypeError("x")\n',
            "raises TypeError",
        ),
    ],
)
def test_a_fault_is_found(tmp_path: Path, code: str, reason: str) -> None:
    reasons = found(tmp_path, code)
    assert any(reason in one for one in reasons), reasons


@pytest.mark.parametrize(
    "code",
    [
        'def f() -> int:\n    """Return the number of things."""\n',
        "def _f() -> int:\n    return 1\n",
        'class C:\n    """A thing of its own."""\n\n    @property\n    def size(self) -> float:\n        """Length of the thing [m]."""\n',
        ARRAY + 'def f(x: Array) -> None:\n    """Fill x (2 n, 3) with the lengths [m]."""\n',
        ARRAY
        + 'class C:\n    """Points (N, 3) [m]."""\n\n    def f(self, x: Array) -> None:\n        """Take more points."""\n',
        '@njit\ndef f(x):\n    """Double the lengths x (N,) [m] in place."""\n    x[0] = 2\n',
        'def f() -> int:\n    """Return a number; ValueError if there is none."""\n    raise ValueError("x")\n',
    ],
)
def test_a_good_docstring_passes(tmp_path: Path, code: str) -> None:
    assert found(tmp_path, code) == []
