"""A Chromium of the system, as tests and the pictures of the guide open it."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright import sync_api

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
GRAPHICS = (
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)  # WebGL in software, for the 3-D view


def browser(player: sync_api.Playwright) -> sync_api.Browser:
    """Start Chromium."""
    return player.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", *GRAPHICS])
