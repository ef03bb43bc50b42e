"""Tracers with typical mistakes are put to the test: each mistake is found by the check that it belongs to."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_plug import SCENES, plugged, template

from raytracer.__main__ import main
from raytracer.exam import STABILITY, Result, examine, summary

COURSE = sorted(SCENES.glob("*.cli"))
SIZE = 24

MISTAKES = {  # what is put in the place of what, and the check that finds it
    "upside down": ("(height - 2 * y) / height", "(2 * y - height) / height", "rays"),
    "half the angle": ("radians(camera.fov) / 2", "radians(camera.fov)", "rays"),
    "not square": ("(2 * x - width) / height", "(2 * x - width) / width", "rays"),
    "no hit at all": ("if t > 0:", "if t < 0:", "hit"),
    "the far root": ("((-b - root) / (2 * a), (-b + root) / (2 * a))", "[(-b + root) / (2 * a)]", "t"),
    "t of a unit ray": ("return t\n", "return t * sqrt(a)\n", "t"),
    "plus for times": ("hit.material.diffuse[k] * light", "hit.material.diffuse[k] + light", "colour"),
    "one light": ("in hit.lights:", "in hit.lights[:1]:", "colour"),
    "light from below": ("max(0.0, dot", "max(0.0, -dot", "colour"),
    "a slip": ("length = sqrt(dot(a, a))", "length = sqrt(dot(a, b))", "colour"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("plug")


def results_of(folder: Path, source: str, scenes: list[Path] = COURSE, size: int = SIZE) -> list[Result]:
    return list(examine(plugged(folder, source), scenes, size))


def test_the_template_is_right_on_the_course_and_not_where_methods_fail(folder):
    results = results_of(folder, template("tracer"))
    assert {result.check for result in results} == {"rays", "hit", "nearest", "t", STABILITY, "colour"}
    assert all(result.right for result in results if result.check != STABILITY)
    wrong = [result.subject for result in results if not result.right]
    assert "far small" in wrong
    assert "ordinary" not in wrong


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_found_by_its_check(mistake, folder):
    right, wrong, check = MISTAKES[mistake]
    assert right in template("tracer")
    results = results_of(folder, template("tracer").replace(right, wrong), COURSE[3:7])
    faulty = {result.check for result in results if not result.right} - {STABILITY}
    assert check in faulty
    assert ("colour" in faulty) == (check == "colour")
    assert ("rays" in faulty) == (check == "rays")
    first = next(result for result in results if result.check == check and not result.right)
    assert first.fault if mistake == "a slip" else any("yours: " in line for line in first.story)
    assert any(str(first) in line for line in summary(results))


def test_hits_from_inside_are_asked_for(folder):
    near_alone = template("tracer").replace("((-b - root) / (2 * a), (-b + root) / (2 * a))", "[(-b - root) / (2 * a)]")
    inside = SCENES / "hard" / "03_eye_inside_a_sphere.cli"
    wrong = {r.subject for r in results_of(folder, near_alone, [inside]) if not r.right}
    assert {"hard/03_eye_inside_a_sphere", "on the surface"} <= wrong - {
        r.subject for r in results_of(folder, template("tracer"), [inside]) if not r.right
    }


def test_who_says_only_whether_is_asked_only_that(folder):
    says = template("tracer").replace("return t\n", "return True\n").replace("return None", "return False")
    results = [result for result in results_of(folder, says, COURSE[:4]) if result.check != STABILITY]
    assert {result.check for result in results} == {"rays", "hit", "colour"}
    assert all(result.right for result in results)


def test_a_stage_is_judged_as_the_stage_that_it_says(folder):
    source = template("stage").replace('STAGE = "diffuse"', 'STAGE = "full"')
    results = results_of(folder, source, COURSE[:5])
    assert [result.check for result in results] == ["colour"] * 5
    assert not all(result.right for result in results)
    assert all(result.right for result in results_of(folder, template("stage"), COURSE[:5]))


def test_a_method_is_judged_on_scenes_and_families(folder):
    results = results_of(folder, template("method"), COURSE[:5])
    assert {result.check for result in results} == {"hit", "nearest", "t", STABILITY}
    assert all(result.right for result in results if result.check != STABILITY)


def test_a_scene_that_cannot_be_read_is_told(tmp_path, capsys):
    (tmp_path / "1.cli").write_text("spere")
    (tmp_path / "mine.py").write_text(template("stage"))
    assert main(["test", str(tmp_path / "mine.py"), "--scenes", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert "1.cli:1:1: found 'spere'" in error
    assert error.count("\n") == 1


def test_the_command_says_what_is_right_and_ends_with_1_where_a_scene_of_the_course_is_wrong(tmp_path, capsys):
    scenes, mine = tmp_path / "scenes", tmp_path / "mine.py"
    (scenes / "hard").mkdir(parents=True)
    (scenes / "2.cli").write_text(COURSE[1].read_text())
    (scenes / "hard" / "1.cli").write_text((SCENES / "hard" / "01_far_small_sphere.cli").read_text())
    command = ["test", str(mine), "--size", "16", "--scenes", str(scenes)]
    mine.write_text(template("tracer"))
    assert main(command) == 0
    said = capsys.readouterr().out
    assert f"{mine}: eye_ray, intersect, shade" in said
    assert "scenes of the course: all 1 are right" in said
    assert "  hit       1 of 1 scenes right" in said
    assert "  hit       0 of 1 hard scenes right" in said
    assert "      hard/1: " in said
    mine.write_text(template("tracer").replace("if t > 0", "if t < 0"))
    assert main(command) == 1
    said = capsys.readouterr().out
    assert "scenes of the course: 1 of 1 are wrong: 2" in said
    assert "      2: " in said
    assert "yours: hits nothing" in said
