"""Faults on purpose: a mooring parts and the run goes on; water that fails ends it, and the error says who and when."""

from coupling import CoSimulationError, box
from coupling.testkit import Fault, tank
from recordings import Recorder, draw_picture

SIDE, HEIGHT, DENSITY, SPACING = 0.25, 0.15, 400.0, 0.05  # m, kg/m3, m

with tank(size=(0.5, 0.5, 0.6), depth=0.4, particle_spacing=SPACING) as scene:
    scene.name = "faults on purpose"
    scene.add_body("buoy", box((SIDE, SIDE, HEIGHT)), density=DENSITY, position=(0.25, 0.25, 0.2))
    ends = ((0.25, 0.25, 0.125), (0.25, 0.25, 0.0))
    scene.world.add_line("mooring", "buoy", None, ends, length=0.125, stiffness=2000.0, relaxation_time=0.05)
    scene.faults.line("mooring", at_time=0.3)
    scene.faults.participant("fluid", Fault.NAN, at_time=1.8)
    scene.watch(Recorder("fault_test.rrd"))
    try:
        scene.run(3.0)
    except CoSimulationError as error:
        print(f"the run ended: {error}")
        assert "'fluid'" in str(error) and scene.history.time < 1.81
    else:
        raise AssertionError("the run has not noticed that its water failed")
    readings = scene.readings()
draw_picture("fault_test.rrd", "fault_test.png")

tension = readings.one_series("tension/mooring")
assert (tension.value[tension.time > 0.32] == 0.0).all()  # and the buoy surfaces
height = readings.body("buoy").pose[-75:, 2].mean()
draft, archimedes = readings.level() - height + 0.5 * HEIGHT, DENSITY / 1000.0 * HEIGHT
print(f"draft after the mooring has parted: {draft:.4f} m; Archimedes: {archimedes:.4f} m within {0.3 * SPACING:.4f} m")
assert abs(draft - archimedes) < 0.3 * SPACING
