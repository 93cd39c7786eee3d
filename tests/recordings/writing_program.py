"""A small made-up run, and a program that records it: the subject of the tests and the victim of the kills."""

from __future__ import annotations

import signal
import sys
import time

import numpy as np

from recordings.files.writing import RecordingError
from recordings.model.frame import (
    BodyFrame,
    CameraView,
    Event,
    Frame,
    MeshDescription,
    PhaseDescription,
    PhaseFrame,
    RunDescription,
)
from recordings.sink.recorder import Recorder

STEP = 0.02
BODIES = ("boom/segment-00", "boom/segment-01", "vessels/port", "rock")
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_CUBE = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]


def describe() -> RunDescription:
    """Oil on water in a tank with a boom of two segments, a vessel and a rock."""
    cube = MeshDescription(vertices=_CORNERS, faces=np.array([*_CUBE, [1, 5, 7], [1, 7, 3]]), color=(9, 8, 7, 255))
    tints = np.arange(4 * len(cube.faces), dtype=np.uint8).reshape(-1, 4)
    painted = MeshDescription(vertices=_CORNERS, faces=cube.faces, face_colors=tints)
    return RunDescription(
        name="made-up",
        text='name = "made-up"\n',
        properties={"oilsim": "0.1.0", "seed": 7},
        particle_spacing=0.1,
        phases=(
            PhaseDescription(name="ocean", rest_density=1027.0, dynamic_viscosity=1e-3),
            PhaseDescription(
                name="oil", rest_density=840.0, dynamic_viscosity=0.1, is_oil=True, color=(50, 30, 10, 255)
            ),
        ),
        meshes=dict.fromkeys(BODIES, cube) | {"vessels/port": painted},
        boundaries={"tank": np.random.default_rng(3).random((40, 3)).astype(np.float32)},
        camera=CameraView((-3.0, -3.0, 2.0), (0.5, 0.5, 0.0)),
    )


def positions(phase: str, index: int, count: int) -> np.ndarray:
    """Positions that differ in every bit from step to step."""
    return np.random.default_rng([index, len(phase)]).normal(size=(count, 3)).astype(np.float32)


def oil_ids(index: int) -> np.ndarray:
    """Oil is emitted from step 2 on, one particle a step, and particle 1002 is lost at step 10."""
    ids = np.arange(1000, 1020 + index if index >= 2 else 1000, dtype=np.uint32)
    return ids[ids != 1002] if index >= 10 else ids


def make_frame(index: int, ocean_count: int = 200) -> Frame:
    """The communication point ``index``."""

    def read_phases() -> dict[str, PhaseFrame]:
        ids = oil_ids(index)
        ocean = PhaseFrame(positions("ocean", index, ocean_count), np.arange(ocean_count, dtype=np.uint32))
        return {"ocean": ocean, "oil": PhaseFrame(positions("oil", index, len(ids)), ids)}

    random = np.random.default_rng(index)
    bodies = {}
    for name in BODIES:
        orientation = random.normal(size=4)
        bodies[name] = BodyFrame(
            position=random.normal(size=3),
            orientation=orientation / np.linalg.norm(orientation),
            linear_velocity=random.normal(size=3),
            angular_velocity=random.normal(size=3),
            wrench=1e3 * random.normal(size=6),
        )
    scalars = {"oil_inside": 1.0 / (index + 1), "tow_tension/port": random.normal(), "probes/gauge": random.normal()}
    return Frame(index=index, time=index * STEP, bodies=bodies, scalars=scalars, read_phases=read_phases)


def leave(number: int, _: object) -> None:
    """End in order, so that the recording is closed."""
    raise SystemExit(128 + number)


def main(path: str, frame_count: int, pause: float, ocean_count: int) -> None:
    """Record, saying after each frame how far it has come."""
    signal.signal(signal.SIGTERM, leave)
    with Recorder(path, frame_rate=1.0 / STEP) as recorder:
        recorder.initialized(describe())
        recorder.event(Event(0.0, "begins", "info", "program"))
        for index in range(frame_count):
            recorder.step_completed(make_frame(index, ocean_count))
            print(index, flush=True)
            time.sleep(pause)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts its background jobs with SIGINT ignored
    try:
        main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]))
    except RecordingError as error:
        print(f"error: {error}", flush=True)
        sys.exit(1)
