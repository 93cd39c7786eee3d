"""Draw a run as a short film of its scene, from start to end, with the simulated time below it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from recordings.pictures.scenes import SceneView
from recordings.replay.moments import key_steps, read_moments, recorded_steps
from recordings.replay.recording import Replay

FILM_ENDINGS = (".gif", ".webp")
FRAMES = 100  # of a film, if so many are recorded
_SECONDS = 10.0  # that it lasts
_LAST_LASTS = 1.5  # [s] of the last frame, before the film begins again
_WIDTH = 640  # [pixels]
_STRIP = 24  # [pixels] below the scene
_FRAMED = 9  # moments that the camera is to see
_TOGETHER = 10  # moments that are read at a time, so that a long run needs no more memory
_COLORS = 96  # of a GIF
_QUALITY = 50  # of WebP, from 0 to 100

Watch = Callable[[Iterable[Image.Image], int], Iterable[Image.Image]]


def draw_film(replay: Replay, film: Path, watch: Watch = lambda images, count: images) -> None:
    """Draw up to `FRAMES` moments, evenly apart, as an animated GIF or WebP file of ten seconds, which begins again.

    watch: passes the images on as they are drawn, and is told how many there will be. Raises RecordingError for a recording without
    frames, and OSError for a file that cannot be written.
    """
    steps = key_steps(recorded_steps(replay), FRAMES)
    images = list(watch(_frames(replay, steps), len(steps)))
    each = round(1000.0 * _SECONDS / len(images))
    lasting = [each] * (len(images) - 1) + [max(each, round(1000.0 * _LAST_LASTS))]
    if film.suffix == ".gif":
        images = _with_one_palette(images)
    options = {"quality": _QUALITY, "method": 4} if film.suffix == ".webp" else {"optimize": False}
    images[0].save(film, save_all=True, append_images=images[1:], duration=lasting, loop=0, **options)


def _frames(replay: Replay, steps: Sequence[tuple[int, float]]) -> Iterator[Image.Image]:
    """Yield the picture of each step, all seen by one camera."""
    view = SceneView(
        replay.run,
        read_moments(replay, key_steps(steps, _FRAMED)),
        _WIDTH,
        exercise_only=replay.run.exercise is not None,
    )
    first, last = steps[0][1], steps[-1][1]
    for start in range(0, len(steps), _TOGETHER):
        for moment in read_moments(replay, steps[start : start + _TOGETHER]):
            scene = (255.0 * np.clip(view.draw(moment), 0.0, 1.0)).round().astype(np.uint8)
            part = (moment.time - first) / (last - first) if last > first else 1.0
            yield _with_time(
                Image.fromarray(scene), "  ·  ".join(filter(None, (replay.run.name, view.note))), moment.time, part
            )


def _with_time(scene: Image.Image, text: str, time: float, part: float) -> Image.Image:
    """Put a strip below a scene: a text, the simulated time [s], and a bar of the part of the run that is over."""
    frame = Image.new("RGB", (scene.width, scene.height + _STRIP), "#26323b")
    frame.paste(scene)
    draw = ImageDraw.Draw(frame)
    draw.rectangle((0, scene.height, part * scene.width, scene.height + 2), fill="#d9822b")
    middle, font = scene.height + 0.5 * _STRIP + 1, ImageFont.load_default(14)
    draw.text((8, middle), text, fill="white", font=font, anchor="lm")
    draw.text((scene.width - 8, middle), f"{time:.1f} s", fill="white", font=font, anchor="rm")
    return frame


def _with_one_palette(images: Sequence[Image.Image]) -> list[Image.Image]:
    """Return images with the same few colours, those of the first, the middle and the last, so that a GIF does not flicker."""
    chosen = [images[0], images[len(images) // 2], images[-1]]
    together = Image.fromarray(np.concatenate([np.asarray(image) for image in chosen]))
    palette = together.quantize(_COLORS)
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
