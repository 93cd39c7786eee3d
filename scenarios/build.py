"""A scenario becomes a coupled run, for loops of one's own: `build(load_scenario(name).scenario)` gives its `Assembly`."""

from __future__ import annotations

from scenarios.running.assembly import Assembly, build

__all__ = ["Assembly", "build"]
