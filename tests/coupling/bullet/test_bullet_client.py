"""A pybullet client of our own ends with whoever held it."""

from __future__ import annotations

import gc
import subprocess
import sys

import pybullet

from coupling.bullet.bullet_client import BulletClient

GRAVITY = (0.0, 0.0, -9.81)


def test_a_client_that_nobody_closes_ends_with_its_owner() -> None:
    owner = BulletClient(GRAVITY, 50)
    client = owner._client
    assert pybullet.isConnected(client)
    del owner
    gc.collect()
    assert not pybullet.isConnected(client)


def test_a_client_is_given_back_once() -> None:
    """Its number may be somebody else's afterwards."""
    owner = BulletClient(GRAVITY, 50)
    owner.close()
    other = pybullet.connect(pybullet.DIRECT)
    assert other == owner._client
    owner.close()
    del owner
    gc.collect()
    assert pybullet.isConnected(other)
    pybullet.disconnect(other)


def test_a_client_that_its_user_disconnected_is_let_be() -> None:
    owner = BulletClient(GRAVITY, 50)
    pybullet.disconnect(owner._client)
    owner.close()


def test_a_process_ends_in_order_with_a_client_open() -> None:
    code = f"from coupling.bullet.bullet_client import BulletClient; client = BulletClient({GRAVITY}, 50)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
