"""An FMU joins a run: a winch, written here and built as an FMU, hauls a buoy under water."""

from coupling import Connection, IsolatedFmu, ScalarModel, box, given, parameter, taken


class Winch(ScalarModel):
    """A winch that hauls in at a constant speed until its line pulls too hard."""

    tension = taken("N")
    speed = parameter("m/s", 0.05)
    stall_pull = parameter("N", 200.0)
    length = given("m", 0.2)

    def advance(self, time: float, step_size: float) -> None:
        """Haul for a step [s]."""
        if self.tension < self.stall_pull:
            self.length -= self.speed * step_size


if __name__ == "__main__":  # the FMU reads this file, too
    from coupling.testkit import tank
    from recordings import Recorder, draw_picture
    from scenarios import main

    assert main(["build-fmu", __file__, "-o", "winch.fmu"]) == 0
    with tank(size=(0.5, 0.5, 0.6), depth=0.4, particle_spacing=0.05) as scene:
        scene.name = "winch as an FMU"
        scene.add_body("buoy", box((0.2, 0.2, 0.2)), density=400.0, position=(0.25, 0.25, 0.3))
        ends = ((0.25, 0.25, 0.2), (0.25, 0.25, 0.0))
        scene.world.add_line("line", "buoy", None, ends, length=0.2, stiffness=4000.0, relaxation_time=0.05)
        cables = [
            Connection("bodies", "line.tension", "winch", "tension"),
            Connection("winch", "length", "bodies", "line.length"),
        ]
        scene.add_participant(IsolatedFmu("winch", "winch.fmu"), cables)
        scene.watch(Recorder("fmu_in.rrd"))
        scene.run(2.0)
        readings = scene.readings()
    draw_picture("fmu_in.rrd", "fmu_in.png")

    height, tension = readings.body("buoy").pose[:, 2], readings.one_series("tension/line").value[-1]
    hauled = height[0] - height[-1] + tension * 0.1 / 4000.0  # and the line's stretch
    print(f"hauled: {hauled:.4f} m; speed of the winch by time: {0.05 * 2.0:.4f} m within 0.0050 m")
    assert abs(hauled - 0.1) < 0.005
