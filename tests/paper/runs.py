"""The runs behind each figure, coarser than the paper's so that all of them end in minutes."""

from __future__ import annotations

from tests.paper.scenes import OURS, PAPER, Scene, Setting

OILS = (2.6e-3, 9.0e-3, 1.0e-1)  # [Pa s] the paper's three
CORRECTION = 1.0e4  # γ of the paper's Eq. 29
POURED = 9.0e-3  # [Pa s] the paper's oil on the rock
THICK = Setting(name="split scheme, SI, oil 10⁴ times as thick", entries=OURS.entries)
MOMENTS = (1.0, 5.0, 10.0)  # [s] of the paper's Fig. 3 and 4
# [m] spacings of the figures; the paper has 0.03 in Fig. 3 and 4, and does not tell that of Fig. 5
SPACINGS = {3: 0.08, 4: 0.1, 5: 0.03}
SQUARE = (  # a sea as wide as it is long: the paper's is twice as long as wide, along the wind
    "tank.lower=[0, -1, 0]", "tank.upper=[4, 3, 4]", "fill.ocean.lower=[0, -1, 0]", "fill.ocean.upper=[4, 3, 0.3]",
)  # fmt: skip
WAVES = ("tank.zones.wave_maker.lower=[3, -1, 0]", "tank.zones.wave_maker.upper=[4, 3, 4]")


def calm(finer: float = 1.0) -> list[Scene]:
    """Return the runs of Fig. 3, so many times finer; oils that are thicker by γ for two seconds only, and not drawn."""
    shared = {"scenario": "calm-spread", "entries": (_spacing(3, finer),)}
    drawn = [
        Scene(setting=setting, viscosity=oil, duration=10.0, moments=MOMENTS, **shared)
        for setting in (PAPER, OURS)
        for oil in OILS
    ]
    thick = [Scene(setting=THICK, viscosity=CORRECTION * oil, duration=2.0, moments=(), **shared) for oil in OILS]
    return drawn + thick


def wind(finer: float = 1.0) -> list[Scene]:
    """Return the runs of Fig. 4 on a square sea, and for each setting the thinnest oil on the same sea in a calm, which is not drawn."""
    windy = [
        Scene(
            scenario="wind-drift",
            setting=setting,
            viscosity=oil,
            duration=10.0,
            moments=MOMENTS,
            entries=(*SQUARE, *WAVES, _spacing(4, finer)),
        )
        for setting in (PAPER, OURS)
        for oil in OILS
    ]
    return windy + [
        Scene(
            scenario="calm-spread",
            setting=setting,
            viscosity=OILS[0],
            duration=10.0,
            moments=(),
            entries=(*SQUARE, _spacing(4, finer)),
        )
        for setting in (PAPER, OURS)
    ]


def rock(finer: float = 1.0) -> list[Scene]:
    """Return the runs of Fig. 5: the paper's setting, its oil in SI, and an oil that is as thick as γ makes it; 5 s after the pipe ends."""
    kinds = ((PAPER, POURED), (OURS, POURED), (THICK, CORRECTION * POURED))
    return [
        Scene(
            scenario="rock-coating", setting=setting, viscosity=oil, duration=30.0, moments=(10.0, 15.0, 20.0, 25.0),
            entries=(_spacing(5, finer),),
        )
        for setting, oil in kinds
    ]  # fmt: skip


def _spacing(figure: int, finer: float) -> str:
    """Return the entry that sets a figure's spacing, so many times finer."""
    return f"fluid.particle_spacing={SPACINGS[figure] / finer:.4g}"
