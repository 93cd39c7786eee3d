"""Runs and instants as observers see them: plain, read-only records of numpy arrays.

Conventions: SI units; world frame with z up; quaternions xyzw; twist and wrench in the world frame about the centre of mass. A body's
name gives its group: ``boom/segment-03``, ``vessels/port``, ``bodies/rock`` (a name without a slash is a plain body).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from types import MappingProxyType
from typing import Literal

import numpy as np
import numpy.typing as npt

from recordings.model.exercise import BoomDescription, ExerciseDescription, Site, WindowDescription
from recordings.model.surface import FilmFrame, SurfaceFrame

Color = tuple[int, int, int, int]  # red, green, blue, opacity, each 0 to 255
EventLevel = Literal["info", "warning", "error"]
EVENT_LEVELS: tuple[EventLevel, ...] = ("info", "warning", "error")
# sources of events: what people order, by their stations, as "crew port (Ana)"; orders of the scenario itself; messages by radio
INSTRUCTOR, CREW, INJECTS, VHF = "instructor", "crew", "injects", "VHF"
LOST_BY = "lost_"  # beginning of the fates of oil that booms have lost

_BODY_LENGTHS = (("position", 3), ("orientation", 4), ("linear_velocity", 3), ("angular_velocity", 3), ("wrench", 6))
_ENDS = list(accumulate(length for _, length in _BODY_LENGTHS))
_PARTS = {name: slice(end - length, end) for (name, length), end in zip(_BODY_LENGTHS, _ENDS, strict=True)}
_NOTHING: Mapping[str, object] = MappingProxyType({})


def _require_shape(what: str, array: npt.NDArray[np.generic], shape: tuple[int | None, ...]) -> None:
    """Raise ValueError unless ``array`` has this shape; None stands for any length."""
    fits = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = "(" + ", ".join("any" if want is None else str(want) for want in shape) + ")"
        raise ValueError(f"{what} has shape {array.shape}, allowed: {wanted}")


@dataclass(frozen=True, eq=False)
class PhaseFrame:
    """The particles of one phase at one instant, ordered by particle id.

    Attributes:
        position: (N, 3) float32 [m], a fresh copy that the solver does not write into.
        id: (N,) uint32, the same number for the same particle during the whole run.
        volume, width: (N,) float32 [m3], [m] of each parcel of oil and of the square that it covers; None of particles, all alike.
        fate: (N,) uint8, places in `RunDescription.fates`; None of what is no oil.

    Raises ValueError for arrays of other shapes.
    """

    position: npt.NDArray[np.float32]
    id: npt.NDArray[np.uint32]
    volume: npt.NDArray[np.float32] | None = None
    width: npt.NDArray[np.float32] | None = None
    fate: npt.NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        _require_shape("phase position", self.position, (None, 3))
        for name in ("id", "volume", "width", "fate"):
            if getattr(self, name) is not None:
                _require_shape(f"phase {name}", getattr(self, name), (len(self.position),))


NO_PARTICLES = PhaseFrame(np.empty((0, 3), np.float32), np.empty(0, np.uint32))


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyFrame:
    """One rigid body at one instant; ValueError for arrays of other shapes.

    Attributes:
        position: (3,) centre of mass [m].
        orientation: (4,) quaternion xyzw, body frame to world frame.
        linear_velocity: (3,) [m/s].
        angular_velocity: (3,) [rad/s].
        wrench: (6,) force [N] and torque [N m] of the fluid on the body, mean over the last communication step.
        tension: pull [N] in a boom or line that this body is part of; NaN for other bodies.
        held_speed: speed [m/s] at which water keeps running against this segment of a boom; NaN for other bodies.
    """

    position: npt.NDArray[np.float64]
    orientation: npt.NDArray[np.float64]
    linear_velocity: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    angular_velocity: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    wrench: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(6))
    tension: float = math.nan
    held_speed: float = math.nan

    def __post_init__(self) -> None:
        for name, length in _BODY_LENGTHS:
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.shape != (length,):
                raise ValueError(f"body {name} has shape {value.shape}, allowed: ({length},)")
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, motion: npt.NDArray[np.float64], tension: float, held_speed: float) -> BodyFrame:
        """Return the body of a `motion` (19,), of which it keeps views, a tension [N] and a speed [m/s]; ValueError for another shape."""
        if motion.shape != (19,) or motion.dtype != np.float64:
            raise ValueError(f"a body's motion has shape {motion.shape}, type {motion.dtype}, allowed: (19,), float64")
        frame = cls.__new__(cls)
        parts = {name: motion[part] for name, part in _PARTS.items()}
        frame.__dict__.update(parts, tension=tension, held_speed=held_speed, motion=motion)
        return frame

    @cached_property
    def motion(self) -> npt.NDArray[np.float64]:
        """The whole motion in one array (19,): pose (7), twist (6), wrench (6)."""
        return np.concatenate([getattr(self, name) for name in _PARTS])


def _no_surface(*_: object) -> None:
    """Return None."""


class PhasesOnRequest(Mapping[str, PhaseFrame]):
    """The particles of each phase by its name, read when they are first asked for: a frame seldom needs those of all."""

    def __init__(self, readers: Mapping[str, Callable[[], PhaseFrame]]) -> None:
        """Read each phase by its function."""
        self._readers, self._read = dict(readers), dict[str, PhaseFrame]()

    def __getitem__(self, name: str) -> PhaseFrame:
        """Return the particles of a phase; KeyError for a name that does not exist."""
        if name not in self._read:
            self._read[name] = self._readers[name]()
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a phase of that name, without reading it."""
        return name in self._readers

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._readers)

    def __len__(self) -> int:
        """Return the number of phases."""
        return len(self._readers)


class Frame:
    """One communication point: its numbers at once, its particles and bodies only on request.

    Copying the particles or the bodies of a large run takes milliseconds, and no observer records most communication points. Therefore
    ``read_phases`` makes ``phases`` on first use, and ``bodies`` may be given as a function that does the same. An observer that wants them
    must ask for them before the simulation moves on, that is, inside ``step_completed``.
    """

    def __init__(
        self,
        *,
        index: int,
        time: float,
        bodies: Mapping[str, BodyFrame] | Callable[[], Mapping[str, BodyFrame]] = dict,
        scalars: Mapping[str, float] = _NOTHING,  # type: ignore[assignment]
        read_phases: Callable[[], Mapping[str, PhaseFrame]] = dict,
        read_surface: Callable[[], SurfaceFrame | None] = _no_surface,
        read_film: Callable[[SurfaceFrame], FilmFrame | None] = _no_surface,
    ) -> None:
        """Describe the communication point ``index`` (whole steps since the start) at ``time`` [s]."""
        self.index = index
        self.time = time
        self._bodies = bodies
        self.scalars = scalars
        self._read_phases = read_phases
        self._read_surface, self._read_film = read_surface, read_film

    @cached_property
    def bodies(self) -> Mapping[str, BodyFrame]:
        """The bodies by name."""
        return self._bodies() if callable(self._bodies) else self._bodies

    @cached_property
    def phases(self) -> Mapping[str, PhaseFrame]:
        """The particles of each phase by its name."""
        return self._read_phases()

    def read_particles(self) -> None:
        """Read the particles of all phases before they move on."""
        dict(self.phases)

    @cached_property
    def surface(self) -> SurfaceFrame | None:
        """The surface of the sea; None in a run without one by formulas."""
        return self._read_surface()

    @cached_property
    def film(self) -> FilmFrame | None:
        """The oil on the surface, over the surface's box; None without a surface or without oil as parcels."""
        return None if self.surface is None else self._read_film(self.surface)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshDescription:
    """The triangles of a body, in its own frame about its centre of mass.

    Bodies of the same shape may share one object; the segments of a boom that do are stored and drawn by one entity.

    Attributes:
        vertices: (V, 3) float32 [m].
        faces: (F, 3) uint32, indices of vertices, counter-clockwise seen from outside.
        color: red, green, blue, opacity (0 to 255), or None for the colour of the body's group.
        face_colors: (F, 4) uint8, the same for each face by itself; None for one colour.

    Raises ValueError for arrays of other shapes, and for a face with a vertex that does not exist.
    """

    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    color: Color | None = None
    face_colors: npt.NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", np.array(self.vertices, dtype=np.float32))
        object.__setattr__(self, "faces", np.array(self.faces, dtype=np.uint32))
        _require_shape("mesh vertices", self.vertices, (None, 3))
        _require_shape("mesh faces", self.faces, (None, 3))
        if self.face_colors is not None:
            _require_shape("mesh face_colors", self.face_colors, (len(self.faces), 4))
        if len(self.faces) and int(self.faces.max()) >= len(self.vertices):
            raise ValueError(f"a mesh face has the vertex {self.faces.max()}, allowed: 0 to {len(self.vertices) - 1}")


@dataclass(frozen=True, kw_only=True)
class PhaseDescription:
    """One fluid of the run: rest density [kg/m3], dynamic viscosity [Pa s], whether it is oil, colour (None: the usual one)."""

    name: str
    rest_density: float
    dynamic_viscosity: float = 0.0
    is_oil: bool = False
    color: Color | None = None


@dataclass(frozen=True)
class CameraView:
    """The camera of a picture: ``eye`` looks at ``target``, both [m] in the world frame, z up."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class RunDescription:
    """Everything about a run that does not change.

    Attributes:
        name: the scenario's name, the recording's title.
        text: the scenario file's text, empty for a run made by Python calls.
        properties: versions, seed, overrides and other facts that distinguish the run.
        phases: the fluids, in drawing order.
        meshes: bodies by name; a body without a mesh is recorded as a pose only.
        boundaries: static boundary particles by name, (M, 3) float32 [m] in the world frame.
        particle_spacing: edge of a particle's rest volume [m].
        camera: the opening view; None lets the viewer choose.
        plots: diagrams by title, with their scalars (names or "prefix/**"); all other scalars get the usual diagrams.
        exercise: booms, current and water level, for the debrief; None for a run without booms.
        site: place on Earth and date; None if unknown.
        dimension: 3, or 2 for a plane, which is a slice one metre thick.
        windows: the boxes of particles inside a sea by formulas; none in other runs.
        fates: names of the fates of oil, by their codes in `PhaseFrame.fate`; "lost_CAUSE" is oil that a boom has lost.

    Raises ValueError for a particle spacing that is not above 0 and for boundaries of another shape.
    """

    name: str
    particle_spacing: float
    phases: tuple[PhaseDescription, ...] = ()
    text: str = ""
    properties: Mapping[str, str | float] = field(default_factory=dict)
    meshes: Mapping[str, MeshDescription] = field(default_factory=dict)
    boundaries: Mapping[str, npt.NDArray[np.float32]] = field(default_factory=dict)
    camera: CameraView | None = None
    plots: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    exercise: ExerciseDescription | None = None
    site: Site | None = None
    dimension: int = 3
    windows: tuple[WindowDescription, ...] = ()
    fates: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.particle_spacing > 0.0:
            raise ValueError(f"particle_spacing is {self.particle_spacing} m, allowed: above 0 m")
        for name, points in self.boundaries.items():
            _require_shape(f"boundary {name}", np.asarray(points), (None, 3))

    @property
    def booms(self) -> tuple[BoomDescription, ...]:
        """The booms of the exercise; none without one."""
        return () if self.exercise is None else self.exercise.booms

    @property
    def particle_volume(self) -> float:
        """Rest volume [m3] of a particle; in a plane, of a particle one metre wide."""
        return self.particle_spacing**self.dimension

    @property
    def causes(self) -> dict[str, int]:
        """The causes by which booms may lose oil, with the code of that fate."""
        return {name.removeprefix(LOST_BY): code for code, name in enumerate(self.fates) if name.startswith(LOST_BY)}

    @property
    def oils(self) -> tuple[str, ...]:
        """Names of the phases that are oil."""
        return tuple(phase.name for phase in self.phases if phase.is_oil)


@dataclass(frozen=True)
class Event:
    """A line of the log: simulated time [s], text, level and source; ValueError for an unknown level."""

    time: float
    text: str
    level: EventLevel = "info"
    source: str = ""

    def __post_init__(self) -> None:
        if self.level not in EVENT_LEVELS:
            raise ValueError(f"event level is {self.level!r}, allowed: {', '.join(EVENT_LEVELS)}")

    @property
    def is_by_people(self) -> bool:
        """True for what the instructor or a crew has ordered, or done with the run."""
        return self.source.partition(" ")[0] in (INSTRUCTOR, CREW)

    @property
    def is_order(self) -> bool:
        """True for what people or the scenario's injects have ordered."""
        return self.source == INJECTS or self.is_by_people

    @property
    def urgency(self) -> int:
        """2 for what a boom warns of, losses above all, 1 for other warnings, else 0; a page with little room shows the most urgent."""
        if self.level == "info":
            return 0
        return 2 if self.source.startswith("boom ") else 1
