"""Write the page of examples from the scripts: ``python docs/examples.py``.

With ``--pictures [NAME ...]`` it runs them, too, all or those, and keeps their pictures.
"""

from __future__ import annotations

import ast
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).parent
SCRIPTS = DOCS.parent / "examples"
WIDTH = 900  # [pixels]
PAGE = """# Examples

Ten scripts of some 30 to 60 lines. Each runs by itself in a few seconds (`python examples/water_in_pybullet.py`), leaves a picture and
mostly a recording in the current folder, and prints a number beside its formula. CI runs them all. `python docs/examples.py` writes this
page from the scripts.
"""
PART = """
## {title}
{sentence}

![{sentence}](pictures/examples/{name}.jpg)

<details markdown><summary><code>examples/{name}.py</code></summary>

```python
{code}
```

</details>
"""
ORDER = (
    "water_in_pybullet", "arm_that_pours", "boat_with_thrusters", "moored_buoy", "boom_in_current", "oil_drop", "fmu_in", "fmu_out",
    "fault_test", "replay_to_numpy",
)  # fmt: skip


def examples_page() -> str:
    """The whole page as Markdown."""
    return PAGE + "".join(map(_part, ORDER))


def _part(name: str) -> str:
    """A script: its sentence, its picture, and itself."""
    code = (SCRIPTS / f"{name}.py").read_text(encoding="utf-8").strip()
    title, _, sentence = (ast.get_docstring(ast.parse(code)) or "").partition(": ")
    return PART.format(title=title, sentence=sentence[:1].upper() + sentence[1:], name=name, code=code)


def draw(name: str) -> None:
    """Run a script in a folder of its own, and keep its picture small."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, str(SCRIPTS / f"{name}.py")], cwd=folder, check=True)
        picture = Image.open(Path(folder) / f"{name}.png").convert("RGB")
    small = picture.resize((WIDTH, WIDTH * picture.height // picture.width), Image.Resampling.LANCZOS)
    small.save(DOCS / "pictures" / "examples" / f"{name}.jpg", quality=80, optimize=True)


if __name__ == "__main__":
    if "--pictures" in sys.argv[1:2]:
        for chosen in sys.argv[2:] or ORDER:
            draw(chosen)
    (DOCS / "examples.md").write_text(examples_page(), encoding="utf-8")
