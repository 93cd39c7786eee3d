"""Runs every shipped scenario, coarse and short, and draws its picture from its recording into docs/pictures.

``python docs/pictures.py [NAME ...]``: about half an hour on one core for all of them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from PIL import Image

from recordings.pictures.picture import draw_picture
from scenarios.cli import main

FOLDER = Path(__file__).with_name("pictures")
SIZE = (1200, 750)
WINDOW = (
    "run.communication_step=0.05", "fluid.particle_spacing=0.08", "fluid.sleep_speed=0.03", "window.target=main",
    "window.size=[3.2, 3.2]", "window.depth=0.6", "window.rim=0.6",
)  # fmt: skip
RUNS: dict[str, list[str]] = {
    "u-sweep": ["--demo"],
    "u-sweep-window": [
        *(part for change in WINDOW for part in ("--set", change)),
        "--until",
        "18",
    ],
    "calm-spread": ["--set", "fluid.particle_spacing=0.05", "--until", "4"],
    "wind-drift": ["--set", "fluid.particle_spacing=0.05", "--until", "4"],
    "rock-coating": ["--demo"],
    "dam-break": ["--set", "fluid.particle_spacing=0.02"],
    "wave-flume": ["--until", "6"],
    "floating-box": ["--demo"],
    "two-layer": ["--set", "fluid.particle_spacing=0.033", "--until", "2"],
    "still-column": ["--until", "2"],
    # exercises, with the orders of a good crew
    "j-sweep-skimmer": [
        "--set",
        "injects.waits={at=155.0, orders=['tow.speed_kn=0.05'], text='The crew waits for the brush'}",
    ],
    "v-sweep": [],
    "open-apex-follow": [],
    "anchored-containment": [],
    "inlet-exclusion": [],
    "river-diversion-cascade": ["--until", "125"],
    "shore-seal": [],
    "deploy-and-connect": [
        "--set",
        "injects.connects={when={signal='ties.connect.distance', below=4.0}, orders=['ties.connect.made_fast=true'],"
        " text='The crew connects the booms'}",
    ],
    "launch-from-slip": [
        "--set",
        "injects.pays={at=12.0, orders=['ties.brake.hauled=-54.0'], text='The crew ashore pays out'}",
        "--until",
        "235",
    ],
    "tow-speed-ramp": ["--demo"],
    "tow-speed-trial": [],
}


def make(name: str, folder: Path) -> None:
    """Run one scenario and draw it."""
    recording = folder / f"{name}.rrd"
    code = main(
        ["run", name.removesuffix("-window"), *RUNS[name], "--threads", "1", "--overwrite", "--record", str(recording)]
    )
    if code != 0:
        raise SystemExit(f"{name} ended with {code}")
    whole = folder / f"{name}.png"
    draw_picture(recording, whole)
    target = (FOLDER.parent if name == "u-sweep" else FOLDER) / f"{name}.jpg"
    Image.open(whole).convert("RGB").resize(SIZE, Image.Resampling.LANCZOS).save(target, quality=85, optimize=True)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        for chosen in sys.argv[1:] or RUNS:
            make(chosen, Path(temporary))
