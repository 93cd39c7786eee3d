"""A small exercise without particles, for tests of what steers a run."""

from __future__ import annotations


def small_tow(*, duration: float, communication_step: float, frame_rate: int, more: str = "") -> str:
    """Return the file of two vessels that tow a boom of eight segments through a calm sea; `more` are further keys of its root."""
    return f"""
name = "tow"
title = "Two vessels tow a boom"
run = {{duration = {duration}, communication_step = {communication_step}, threads = 1}}
fidelity = "none"
recording = {{frame_rate = {frame_rate}, checkpoint_interval = 0}}
fluid = {{particle_spacing = 0.25}}
phases.water = {{density = 1025.0, dynamic_viscosity = 1.0e-3}}
tank = {{lower = [-60.0, -60.0, -10.0], upper = [60.0, 60.0, 5.0], open = ["-x", "+x", "-y", "+y", "+z"]}}
sea.depth = 10.0
tow = {{speed = 0.3, heading = 0.0}}
{more}
[vessels]
port = {{length = 6.0, beam = 2.0, draft = 0.6, depth = 1.2, position = [0.0, 6.0], bollard_pull = 4e3, yaw_moment = 2e4}}
starboard = {{length = 6.0, beam = 2.0, draft = 0.6, depth = 1.2, position = [0.0, -6.0], bollard_pull = 4e3, yaw_moment = 2e4}}

[booms.main]
ends = ["port", "starboard"]
length = 24.0
segments = 8
skirt_depth = 0.4
freeboard = 0.3
tow_line = 2.0
"""
