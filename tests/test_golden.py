"""Every scene at every stage, small, against the picture that is kept in tests/golden.

A picture that differs leaves what was expected, what was found and their difference in tests/report. After a change
that is meant, `python -m pytest tests/test_golden.py --store` keeps the new pictures: look at them before you commit.
"""

from pathlib import Path

import numpy as np
import pytest

from raytracer import STAGES, interpreter, load_png, render_scene, save_png

SIZE = 48
GOLDEN, REPORT = Path(__file__).parent / "golden", Path(__file__).parent / "report"


@pytest.mark.parametrize("stage", STAGES)
def test_picture_is_as_kept(scene_path, stage, request):
    found = render_scene(interpreter(scene_path), stage, SIZE, SIZE)
    kept = GOLDEN / f"{scene_path.stem}-{stage}.png"
    if request.config.getoption("--store"):
        GOLDEN.mkdir(exist_ok=True)
        save_png(kept, found)
    assert kept.exists(), f"no {kept}: --store keeps one"
    expected = load_png(kept)
    if not np.array_equal(expected, found):
        report = write_report(kept.stem, expected, found)
        wrong = int((expected != found).any(axis=2).sum())
        pytest.fail(f"{wrong} of {SIZE * SIZE} pixels differ; see {report}")


def write_report(name, expected, found):
    """Expected, found and their difference, side by side and enlarged."""
    REPORT.mkdir(exist_ok=True)
    difference = np.abs(expected.astype(int) - found).astype(np.uint8)
    difference = np.where(difference > 0, np.maximum(difference, 64), 0).astype(np.uint8)
    save_png(REPORT / f"{name}.png", np.hstack([expected, found, difference]).repeat(6, axis=0).repeat(6, axis=1))
    return REPORT / f"{name}.png"


def test_no_picture_is_kept_for_nothing(request):
    scenes = {path.stem for path in (GOLDEN.parent.parent / "scenes").rglob("*.cli")}
    assert {path.stem for path in GOLDEN.glob("*.png")} == {f"{scene}-{stage}" for scene in scenes for stage in STAGES}


def test_a_report_shows_the_difference(tmp_path, monkeypatch):
    monkeypatch.setattr("test_golden.REPORT", tmp_path)
    expected = np.zeros((2, 2, 3), np.uint8)
    found = expected.copy()
    found[0, 1] = 1
    shown = load_png(write_report("x", expected, found))
    assert shown.shape == (12, 36, 3)
    assert shown[0, -1].tolist() == [64, 64, 64]
    assert shown[-1, -1].tolist() == [0, 0, 0]
