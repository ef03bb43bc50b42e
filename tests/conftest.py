"""The same examples at every run: a test that fails once fails again."""

from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest
from hypothesis import settings

from raytracer import backend, interpreter, machine_code, make_plan
from raytracer.render import hits_of, open_tracer, warm_up

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

SCENES = Path(__file__).parent.parent / "scenes"
MANY = 100  # tests, of which some will want any kernel
COURSE, HARD = sorted(SCENES.glob("*.cli")), sorted(SCENES.glob("hard/*.cli"))


@pytest.fixture(scope="session", autouse=True)
def machine_code_of_tests(request):
    """Kept for the kernels' sources as they are: tests have kernels of their own, which call into those."""
    if backend.why_no_compiler():
        yield
        return
    from raytracer.kernels.compiler import cache_named_after_sources

    folder = machine_code.folder()
    if fcntl is not None and folder and len(request.session.items) > MANY:
        compile_together(folder)
    with cache_named_after_sources():
        yield


def compile_together(folder):
    """Make the kernels' machine code, each in one of the processes that run tests; else each would make all of it."""
    scene = interpreter(COURSE[0])
    left = {stage: partial(warm_up, scene, stage) for stage in ("hit", "diffuse", "full", "depth", "normal", "edges")}
    left["eye_hits"] = partial(find_hits, scene)
    for wait in (fcntl.LOCK_NB, 0):
        for stage in list(left):
            with (folder / f"{stage}.lock").open("w") as lock, suppress(BlockingIOError):
                fcntl.flock(lock, fcntl.LOCK_EX | wait)
                left[stage]()
                del left[stage]


def find_hits(scene):
    plan = make_plan(scene, "hit", 16, 16, path=backend.import_kernels())
    with open_tracer(plan) as tracer:
        hits_of(plan, tracer, polished=True)


@pytest.fixture(params=COURSE + HARD, ids=lambda path: path.stem)
def scene_path(request):
    return request.param


@pytest.fixture(params=COURSE, ids=lambda path: path.stem)
def course_scene_path(request):
    return request.param


def pytest_addoption(parser):
    parser.addoption("--store", action="store_true", help="keep the pictures found as those to expect")
