"""Bodies whose shapes pybullet cannot tell are refused by name, and the process lives."""

from __future__ import annotations

import threading
import warnings

import pybullet
import pytest

from coupling.bullet import shapes
from coupling.bullet.links import LinkedBody


@pytest.mark.parametrize("name", ["ant", "humanoid", "hopper", "half_cheetah", "capsule_fromtoX", "walker2d"])
def test_bodies_of_mjcf_files_are_refused_where_asking_would_end_the_process(pybullet_client: int, name: str) -> None:
    body = pybullet.loadMJCF(f"mjcf/{name}.xml", physicsClientId=pybullet_client)[-1]
    with pytest.raises(ValueError, match=f"body {body}: pybullet's getCollisionShapeData (ends|may end) the process"):
        LinkedBody(pybullet_client, body)


@pytest.mark.parametrize("name", ["capsule", "cylinder_fromtoX", "hello_mjcf"])
def test_bodies_of_mjcf_files_are_taken_where_pybullet_can_tell_them(pybullet_client: int, name: str) -> None:
    body = pybullet.loadMJCF(f"mjcf/{name}.xml", physicsClientId=pybullet_client)[-1]
    assert LinkedBody(pybullet_client, body).keys == [
        (body, link) for link in range(-1, pybullet.getNumJoints(body, physicsClientId=pybullet_client))
    ]


def test_a_body_is_taken_beside_one_that_cannot_be(pybullet_client: int) -> None:
    pybullet.loadMJCF("mjcf/ant.xml", physicsClientId=pybullet_client)
    robot = pybullet.loadURDF("r2d2.urdf", physicsClientId=pybullet_client)
    assert len(LinkedBody(pybullet_client, robot).keys) == 1 + pybullet.getNumJoints(
        robot, physicsClientId=pybullet_client
    )


def test_the_copy_that_is_asked_first_is_not_warned_of_beside_threads(pybullet_client: int) -> None:
    """From Python 3.12 on, `os.fork` warns in a process that has threads."""
    cube = pybullet.loadURDF("cube.urdf", physicsClientId=pybullet_client)
    done = threading.Event()
    beside = threading.Thread(target=done.wait)
    beside.start()
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            shapes.require_askable(pybullet_client, cube)
    finally:
        done.set()
        beside.join()
    assert not told


def test_where_the_engine_runs_elsewhere_its_own_file_tells(
    pybullet_client: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with a window or a shared memory, whose engine a copy of this process could not ask."""
    monkeypatch.setattr(shapes, "_OWN", set())
    cube = pybullet.loadURDF("cube.urdf", physicsClientId=pybullet_client)
    shapes.require_askable(pybullet_client, cube)
    ant = pybullet.loadMJCF("mjcf/ant.xml", physicsClientId=pybullet_client)[-1]
    with pytest.raises(ValueError, match="may end the process"):
        shapes.require_askable(pybullet_client, ant)
    shapes.require_askable(pybullet_client, cube)
