"""A watched pybullet world shows its bodies as they are, whether they meet the fluid or not."""

from __future__ import annotations

import pybullet
import pytest

from coupling import attach_fluid
from coupling.testkit import pool, watch
from oilsim.core.physical_constants import GRAVITY


def test_body_that_does_not_meet_the_fluid_falls_by_it() -> None:
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.1] * 3, physicsClientId=client)
        afloat, alone = (
            pybullet.createMultiBody(4.0, shape, basePosition=place, physicsClientId=client)
            for place in ((0.25, 0.25, 0.3), (2.0, 0.0, 5.0))
        )
        for body in (afloat, alone):
            pybullet.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
        fluid, basin = pool(client, [afloat], lower=(0, 0, 0), upper=(0.5, 0.5, 0.5), depth=0.3, particle_spacing=0.05)
        world = attach_fluid(client, fluid, [afloat])
        assert world.meets(afloat) and not world.meets(alone)
        with watch(world, {"afloat": afloat, "alone": alone}, basin=basin) as watched:
            for _ in range(24):
                watched.step()
            readings = watched.readings()
        assert (readings.body("alone").wrench == 0.0).all()
        assert readings.body("afloat").wrench[-1, 2] > 0.0
        # symplectic Euler: g t (t + dt) / 2
        fallen = 0.5 * GRAVITY * 0.1 * (0.1 + 1.0 / 240.0)
        assert 5.0 - readings.body("alone").pose[-1, 2] == pytest.approx(fallen, rel=1e-6)
    finally:
        pybullet.disconnect(client)
