"""The pytest plugin `oilsim`: fixtures, markers and options for tests of fluid-solid coupling.

It is idle until a test asks for one of its fixtures: this module imports no numerics. `-p no:oilsim` switches it off. A test that fails
leaves a recording, a checkpoint and a picture, see `scenarios.bench.evidence`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from coupling.testkit.scene import Scene
    from coupling.testkit.tanks import TankScene
    from coupling.testkit.watched_world import WatchedWorld
    from scenarios.bench.evidence import TestBench
    from scenarios.bench.fmu_runner import FmuRunner
    from scenarios.bench.scenario_run import ScenarioRun, SeaScene

RECORD = ("failed", "always", "never")
LIMITS = "oilsim_limits(seconds=None, particles=None): wall time [s] of all steps but each run's first, and particles, that a test may take"
_BENCH = pytest.StashKey[Any]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options."""
    group = parser.getgroup("oilsim", "oilsim: tests of fluid-solid coupling")
    group.addoption(
        "--oilsim-record", choices=RECORD, default="failed",
        help="which tests leave recording, checkpoint and picture (default: failed)",
    )  # fmt: skip
    group.addoption(
        "--oilsim-output", type=Path, default=None, metavar="FOLDER",
        help="where tests leave these (default: oilsim-report below the root directory)",
    )  # fmt: skip
    group.addoption(
        "--oilsim-update", action="store_true",
        help="write the references of assert_matches_recording anew instead of comparing with them",
    )  # fmt: skip


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    config.addinivalue_line("markers", LIMITS)


@pytest.fixture
def oilsim_bench(request: pytest.FixtureRequest) -> Iterator[TestBench]:
    """Return the bench of this test: it makes and watches runs, seeds random numbers, and keeps to one thread."""
    from scenarios.bench.evidence import TestBench

    config = request.config
    is_updating = config.getoption("--oilsim-update")
    bench = TestBench(
        request.node.nodeid,
        keeps_frames=is_updating or config.getoption("--oilsim-record") != "never",
        marker=request.node.get_closest_marker("oilsim_limits"),
        is_updating=is_updating,
        worker=_is_worker(config),
    )
    request.node.stash[_BENCH] = bench
    with bench:
        yield bench


@pytest.fixture
def water_tank(oilsim_bench: TestBench) -> Callable[..., TankScene]:
    """Return `coupling.testkit.tank`, whose scenes are watched, and closed after the test."""
    from coupling.testkit.tanks import tank

    return oilsim_bench.making(tank)


@pytest.fixture
def flume(oilsim_bench: TestBench) -> Callable[..., TankScene]:
    """Return `coupling.testkit.flume`, whose scenes are watched, and closed after the test."""
    from coupling.testkit.tanks import flume

    return oilsim_bench.making(flume)


@pytest.fixture
def empty_space(oilsim_bench: TestBench) -> Callable[..., Scene]:
    """Return `coupling.testkit.empty_space`, whose scenes are watched, and closed after the test."""
    from coupling.testkit.tanks import empty_space

    return oilsim_bench.making(empty_space)


@pytest.fixture
def analytic_sea(oilsim_bench: TestBench) -> Callable[..., SeaScene]:
    """Return `scenarios.bench.scenario_run.sea_scene`: bodies in a sea of formulas, without particles."""
    from scenarios.bench.scenario_run import sea_scene

    return oilsim_bench.making(sea_scene)


@pytest.fixture
def scenario_run(oilsim_bench: TestBench) -> Callable[..., ScenarioRun]:
    """Return `scenarios.bench.scenario_run.ScenarioRun`, whose runs are watched, and ended after the test."""
    from scenarios.bench.scenario_run import ScenarioRun

    return oilsim_bench.making(ScenarioRun)


@pytest.fixture
def pybullet_client(oilsim_bench: TestBench) -> Iterator[int]:
    """Return a pybullet client of the test's own, with gravity, pybullet's own data on its search path, and nothing else."""
    import pybullet_data

    from coupling.bullet.pybullet_import import pybullet
    from oilsim.core.physical_constants import GRAVITY

    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setAdditionalSearchPath(pybullet_data.getDataPath(), physicsClientId=client)
    pybullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
    yield client
    if pybullet.isConnected(client):
        pybullet.disconnect(client)


@pytest.fixture
def watched_world(oilsim_bench: TestBench) -> Callable[..., WatchedWorld]:
    """Return `coupling.testkit.watch`: a fluid in a pybullet world, whose steps are kept and recorded."""
    from coupling.testkit.watched_world import watch

    return oilsim_bench.making(watch)


@pytest.fixture
def fmu_runner(oilsim_bench: TestBench, tmp_path: Path) -> FmuRunner:
    """Return a runner of FMUs: builds them from models, steps them, joins them to scenes."""
    from scenarios.bench.fmu_runner import FmuRunner

    return FmuRunner(tmp_path, oilsim_bench.at_end)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Leave recording, checkpoint and picture of a test that asked for them, and add their paths to its report."""
    outcome: Any = yield
    report: pytest.TestReport = outcome.get_result()
    bench: TestBench | None = item.stash.get(_BENCH, None)
    record = item.config.getoption("--oilsim-record")
    if call.when != "call" or bench is None or record == "never" or not (report.failed or record == "always"):
        return
    folder = item.config.getoption("--oilsim-output") or item.config.rootpath / "oilsim-report"
    left = bench.leave(folder, None if call.excinfo is None else call.excinfo.value)
    if left:
        report.sections.append(("oilsim", "\n".join(f"{what}: {path}" for what, path in left)))
        report.user_properties += [(f"oilsim_{what}", str(path)) for what, path in left]
        item.user_properties += [(f"oilsim_{what}", str(path)) for what, path in left]
        _show_in_html(item.config, report, left)


def _show_in_html(config: pytest.Config, report: Any, left: list[tuple[str, Path]]) -> None:
    """Add the files to the report of pytest-html, if that is installed: the picture as an image, the others as links."""
    if not config.pluginmanager.hasplugin("html"):
        return
    from pytest_html import extras

    shown = []
    for what, path in left:
        if what == "picture":
            import base64

            shown.append(extras.png(base64.b64encode(path.read_bytes()).decode("ascii"), name=path.name))
        else:
            shown.append(extras.url(path.absolute().as_uri(), name=path.name))
    report.extras = [*getattr(report, "extras", []), *shown]


def _is_worker(config: pytest.Config) -> bool:
    """Tell whether this process is one of several workers of pytest-xdist."""
    return hasattr(config, "workerinput")
