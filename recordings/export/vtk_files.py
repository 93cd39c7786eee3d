"""VTK polydata of particles and bodies, one file for each instant, with a list that ParaView opens as a film."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from recordings.export.chosen import every
from recordings.model import entity_paths
from recordings.model.frame import PhaseFrame
from recordings.replay.moments import bodies_at, placed_vertices, recorded_steps
from recordings.replay.recording import Replay

Arrays = Mapping[str, npt.NDArray[np.generic]]

NOTHING = np.empty((0, 3))  # vertices
NO_FACES = np.empty((0, 3), np.int64)


def write_vtk(replay: Replay, folder: Path, *, interval: float | None = None) -> int:
    """Write ``PHASE.vtp.series`` and ``bodies.vtp.series`` with their files, ``interval`` [s] apart; return the number of files."""
    folder.mkdir(parents=True, exist_ok=True)
    count = sum(_write_phase(replay, folder, phase.name, interval) for phase in replay.run.phases)
    steps = recorded_steps(replay)
    kept = set(every([index for index, _ in steps], interval, [time for _, time in steps]))
    bodies = [(index, time) for index, time in steps if index in kept] if replay.run.meshes else []
    files = [_write_bodies(replay, folder / f"bodies_{index:06d}.vtp", index) for index, _ in bodies]
    _write_series(folder / "bodies.vtp.series", files, [time for _, time in bodies])
    return count + len(files)


def _write_phase(replay: Replay, folder: Path, name: str, interval: float | None) -> int:
    """Write one phase's particles with their ids and, for oil, the codes of their fates."""
    clock = replay.phase_times(name)
    kept = set(every(clock.index.tolist(), interval, clock.time.tolist()))
    files, times = [], []
    for index, time, frame in replay.particles(entity_paths.phase(name), kept):
        path = folder / f"{name}_{index:06d}.vtp"
        _write(path, frame.position, _particle_data(frame))
        files.append(path)
        times.append(time)
    _write_series(folder / f"{name}.vtp.series", files, times)
    return len(files)


def _particle_data(frame: PhaseFrame) -> Arrays:
    ids = {"id": frame.id.astype(np.int64)}
    return ids if frame.fate is None else ids | {"fate": frame.fate.astype(np.int32)}


def _write_bodies(replay: Replay, path: Path, index: int) -> Path:
    """Write all bodies' surfaces at one step, none where a damaged recording lacks them; each vertex has its body's number and tension."""
    bodies = bodies_at(replay, index)
    shown = [(number, name) for number, name in enumerate(replay.run.meshes) if name in bodies]
    meshes = [replay.run.meshes[name] for _, name in shown]
    counts = [len(mesh.vertices) for mesh in meshes]
    starts = np.cumsum([0, *counts])
    vertices = [placed_vertices(mesh.vertices, bodies[name]) for mesh, (_, name) in zip(meshes, shown, strict=True)]
    data = {
        "body": np.repeat([number for number, _ in shown], counts),
        "tension": np.repeat([bodies[name].tension for _, name in shown], counts),
    }
    faces = [mesh.faces.astype(np.int64) + start for mesh, start in zip(meshes, starts, strict=False)]
    _write(path, np.concatenate([NOTHING, *vertices]), data, np.concatenate([NO_FACES, *faces]))
    return path


def _write(
    path: Path, position: npt.NDArray[np.floating], data: Arrays, faces: npt.NDArray[np.int64] | None = None
) -> None:
    """Write one polydata file: triangles, or a vertex at each point if there are no faces."""
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(position), deep=True))
    surface = vtkPolyData()
    surface.SetPoints(points)
    cells = np.arange(len(position), dtype=np.int64)[:, None] if faces is None else faces
    array = vtkCellArray()
    offsets = np.arange(len(cells) + 1, dtype=np.int64) * cells.shape[1]
    array.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    (surface.SetVerts if faces is None else surface.SetPolys)(array)
    for name, values in data.items():
        column = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        column.SetName(name)
        surface.GetPointData().AddArray(column)
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(surface)
    if not writer.Write():
        raise OSError(f"{path} cannot be written")


def _write_series(path: Path, files: list[Path], times: list[float]) -> None:
    """Write ParaView's list of files and their times."""
    if files:
        entries = [{"name": file.name, "time": time} for file, time in zip(files, times, strict=True)]
        path.write_text(json.dumps({"file-series-version": "1.0", "files": entries}, indent=1), encoding="utf-8")
