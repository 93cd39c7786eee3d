"""A buoy under water at its mooring: the line pulls with what the water lifts, less the weight."""

from coupling import box
from coupling.testkit import tank
from recordings import Recorder, draw_picture

SIDE, DENSITY, SPACING = 0.2, 400.0, 0.05  # m, kg/m3, m
STIFFNESS, LENGTH = 2000.0, 0.1  # N, m

with tank(size=(0.5, 0.5, 0.6), depth=0.4, particle_spacing=SPACING) as scene:
    scene.name = "moored buoy"
    scene.add_body("buoy", box((SIDE, SIDE, SIDE)), density=DENSITY, position=(0.25, 0.25, 0.2))
    ends = ((0.25, 0.25, 0.1), (0.25, 0.25, 0.0))  # of the line: under the buoy, and on the floor
    scene.world.add_line("mooring", "buoy", None, ends, length=LENGTH, stiffness=STIFFNESS, relaxation_time=0.05)
    scene.watch(Recorder("moored_buoy.rrd"))
    scene.run(1.0)
    readings = scene.readings()
draw_picture("moored_buoy.rrd", "moored_buoy.png")

tension = readings.one_series("tension/mooring").value[-50:].mean()
lift = (1000.0 - DENSITY) * 9.81 * SIDE**3
print(f"tension of the mooring: {tension:.2f} N; lift less weight: {lift:.2f} N within {0.1 * lift:.2f} N")
assert abs(tension - lift) < 0.1 * lift
risen = readings.body("buoy").pose[-1, 2] - 0.2
print(f"stretch of the line: {1e3 * risen:.2f} mm; T L / EA: {1e3 * lift * LENGTH / STIFFNESS:.2f} mm within 1.00 mm")
assert abs(risen - lift * LENGTH / STIFFNESS) < 1e-3
