"""The same examples at every run: a test that fails once fails again."""

from pathlib import Path

import pytest
from hypothesis import settings

from raytracer import backend

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

SCENES = Path(__file__).parent.parent / "scenes"
COURSE, HARD = sorted(SCENES.glob("*.cli")), sorted(SCENES.glob("hard/*.cli"))


@pytest.fixture(scope="session", autouse=True)
def machine_code_of_tests():
    """Kept for the kernels' sources as they are: tests have kernels of their own, which call into those."""
    if backend.why_no_compiler():
        yield
        return
    from raytracer.kernels.compiler import cache_named_after_sources

    with cache_named_after_sources():
        yield


@pytest.fixture(params=COURSE + HARD, ids=lambda path: path.stem)
def scene_path(request):
    return request.param


@pytest.fixture(params=COURSE, ids=lambda path: path.stem)
def course_scene_path(request):
    return request.param


def pytest_addoption(parser):
    parser.addoption("--store", action="store_true", help="keep the pictures found as those to expect")
