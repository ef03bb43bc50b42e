"""The same examples at every run: a test that fails once fails again."""

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

SCENES = Path(__file__).parent.parent / "scenes"
COURSE, HARD = sorted(SCENES.glob("*.cli")), sorted(SCENES.glob("hard/*.cli"))


@pytest.fixture(params=COURSE + HARD, ids=lambda path: path.stem)
def scene_path(request):
    return request.param


@pytest.fixture(params=COURSE, ids=lambda path: path.stem)
def course_scene_path(request):
    return request.param


def pytest_addoption(parser):
    parser.addoption("--store", action="store_true", help="keep the pictures found as those to expect")
