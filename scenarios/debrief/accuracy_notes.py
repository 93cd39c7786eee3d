"""Notes on the accuracy of a debriefed run: what particles resolved, what was modelled, and what the figures are worth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from booms.containment import MODELLED, RESOLVED
from booms.losses.resolution import blockage_in_words, skirt_in_words
from recordings.model.exercise import BoomDescription, WindowDescription
from recordings.replay.joined import JoinedReplay
from recordings.replay.recording import Replay

# [1] particles over the skirt's depth, below which leakage is resolved coarsely; tuned; see `booms.losses.resolution`
COARSE = 5.0
COARSE_CLOSED = "The speed of the first loss is that of the closures, in the band of practice; the loss a minute is an order of magnitude."
COARSE_ALONE = "Without closures the boom holds its oil at up to 1.8 times the speed at which real ones lose it."
FORMULAS = "formulas give the sea and the loads on bodies (modelled)"


def accuracy_notes(replay: JoinedReplay) -> list[str]:
    """List what a reader of the page should know about its accuracy, a sentence or two each."""
    boxes = replay.run.properties.get("boxes")
    notes = [*_of_the_water(replay, str(boxes)), *_of_the_recording(replay)]
    booms = replay.run.booms
    if boxes != "none":
        notes += [text for boom in booms for text in _of_a_boom(replay, boom)]
    if len(booms) > 1:
        notes.append(
            "Each boom has its own account: oil that one boom lost and another met, or that two booms hold, is in both accounts."
        )
    return [*notes, *_of_losses(replay, booms, str(boxes))] if booms else notes


def _of_the_water(replay: Replay, boxes: str) -> Iterator[str]:
    """Say what the water is made of."""
    apart = f"{1000.0 * replay.run.particle_spacing:.3g} mm apart"
    if boxes == "none":
        yield f"The run has no particles: {FORMULAS}, and oil is a slick of parcels."
    elif boxes == "windows" and not replay.run.windows:  # of a recording that does not tell them
        yield f"The run has a window of particles {apart}. Outside it {FORMULAS}, and oil is a slick of parcels."
    elif boxes == "windows":
        windows = replay.run.windows
        yield from (_window_in_words(one, len(windows) > 1, one is windows[0]) for one in windows)
        beyond, oil = ("windows", "outside the inner window") if len(windows) > 1 else ("window", "outside")
        yield f"Outside the {beyond} {FORMULAS}. Oil that is {oil}, or thinner than a particle, is a slick of parcels."
    else:
        yield f"The particles are {apart}; the simulation resolves nothing finer."


def _window_in_words(window: WindowDescription, several: bool, has_oil: bool) -> str:
    """Say where a window of particles is, and what it resolves."""
    name = f"The {window.name} window" if several else "The window"
    size = f"{window.size[0]:.3g} by {window.size[1]:.3g} m wide and {window.depth:.3g} m deep"
    return (
        f"{name} of particles is around {window.target}, {size}. Its particles are {1000.0 * window.spacing:.3g} mm apart. They resolve the"
        f" flow around what is in it{', and oil as thick as a particle' * has_oil}, but nothing finer."
    )


def _of_the_recording(replay: Replay) -> Iterator[str]:
    """Say how exact the recorded positions are."""
    if replay.precision is not None:
        yield f"Pictures and outlines show their recorded positions, which are exact to {500.0 * replay.precision:.2g} mm."
    yield from (f"The recording has one in {count} frames of {name}." for name, count in replay.thinning.items())


def _of_a_boom(replay: Replay, boom: BoomDescription) -> Iterator[str]:
    """Say how well particles resolve a boom."""
    spacing, closed = replay.run.particle_spacing, _has_closures(replay, boom)
    told = (skirt_in_words(boom.skirt_depth, spacing, has_closures=closed), blockage_in_words(boom.blockage))
    yield from (f"Boom {boom.name}: {text}." for text in told if text)
    if boom.skirt_depth / spacing < COARSE:
        yield COARSE_CLOSED if closed else COARSE_ALONE


def _of_losses(replay: Replay, booms: Sequence[BoomDescription], boxes: str) -> Iterator[str]:
    """Say which losses particles resolved, and which were modelled."""
    closed = any(_has_closures(replay, boom) for boom in booms)
    if boxes == "none":
        yield (
            "Modelled: all losses, by closures."
            if closed
            else "Modelled: oil that passes a boom's ends; closures were off."
        )
        return
    yield f"The particles resolve {RESOLVED}."
    if not closed:
        yield "Modelled: nothing; closures were off."
    elif boxes == "windows":
        yield f"Modelled: by closures, all losses of oil that is parcels; of oil that is particles, {MODELLED.partition(', ')[2]}."
    else:
        yield f"Modelled: {MODELLED}."


def _has_closures(replay: Replay, boom: BoomDescription) -> bool:
    """Tell whether closures acted at a boom; an old recording tells it by a series alone."""
    if boom.has_closures is not None:
        return boom.has_closures
    return any(name.endswith("closure_loss_rate") for name in replay.scalars)
