"""The chart: a small run from rays to files, and the parts that place what is drawn."""

import csv
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from raytracer import METHODS, Method
from raytracer.chart import Mark, chart, draw_charts, free_box, neighbours, pareto, rule_of_three, shelf_height
from raytracer.families import bundles
from raytracer.measure import (
    COMPILED,
    NUMPY,
    ORDINARY_SCENE,
    STRESS,
    Effort,
    Racer,
    errors_of,
    in_turns,
    plan_on,
    pose,
    score_families,
    score_scenes,
    summary,
    trace,
    trace_bundles,
)
from raytracer.methods import CERTIFIED, Limits

TANGENT = ORDINARY_SCENE.parent / "hard" / "07_tangent_rows.cli"
SMALL = Effort(
    rays=128,
    ordinary_rays=128,
    rounds=2,
    timed_rays=128,
    size=16,
    methods=(CERTIFIED, "textbook", "haines32"),
    families=("ordinary", "far small", "tied"),
    scenes=(ORDINARY_SCENE, TANGENT),
)


def quiet(text):
    pass


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("chart") / "new"
    said = []
    paths = chart(folder, progress=said.append, effort=SMALL)
    assert said[-1] == "drawing"
    assert sorted(paths) == sorted(folder.iterdir())
    return folder


@pytest.fixture(scope="module")
def table(folder):
    with (folder / "chart.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_all_files_are_written(folder):
    names = ("chart", "chart-families", "chart-t", "chart-pictures")
    expected = {f"{name}.{kind}" for name in names for kind in ("png", "svg")} | {"chart.csv"}
    assert {path.name for path in folder.iterdir()} == expected
    assert all(path.stat().st_size > 1000 for path in folder.iterdir())


def test_the_table_has_a_row_for_each_method_family_or_scene_and_backend(table):
    places = (*SMALL.families, STRESS, *(path.stem for path in SMALL.scenes))
    expected = {(place, method, name) for place in places for method in SMALL.methods for name in (COMPILED, NUMPY)}
    assert {(row["place"], row["method"], row["backend"]) for row in table} == expected
    assert len(table) == len(expected)


def test_certified_is_never_wrong_and_textbook_is(table):
    wrong = {(row["place"], row["method"]): int(row["wrong"]) for row in table}
    assert not any(count for (_, method), count in wrong.items() if method == CERTIFIED)
    assert wrong["far small", "textbook"] > 0
    assert wrong[STRESS, "textbook"] == wrong["far small", "textbook"] + wrong["tied", "textbook"]


def test_times_and_errors_are_in_order(table):
    for row in table:
        if row["time_median"]:
            order = ("time_low", "time_quarter", "time_median", "time_three_quarters", "time_high")
            assert float(row[order[0]]) > 0
            assert sorted(order, key=lambda name: float(row[name])) == list(order)
        if row["kind"] == "family":
            assert not float(row["ulps_median"]) > float(row["ulps_999"])
            assert not float(row["ulps_999"]) > float(row["ulps_worst"])


def test_the_same_figures_make_the_same_svg(tmp_path):
    effort = replace(SMALL, families=("tied",), methods=(CERTIFIED,), backends=(NUMPY,), scenes=(TANGENT,))
    scores, frames = score_families(effort, quiet), score_scenes(effort, quiet)
    contents = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        paths = draw_charts(tmp_path / name, scores, frames)
        contents.append([path.read_bytes() for path in paths if path.suffix == ".svg"])
    assert contents[0] == contents[1]


def test_a_wrong_method_shows(monkeypatch):
    def through_the_centre(origin, direction, centre, r):
        along = sum(d * (c - o) for o, d, c in zip(origin, direction, centre, strict=True))
        return np.where(along > 0, along / sum(d * d for d in direction), np.inf)

    monkeypatch.setitem(METHODS, "wrong", Method(through_the_centre, "hits whatever is ahead", "nobody", Limits()))
    effort = replace(SMALL, backends=(NUMPY,), scenes=(ORDINARY_SCENE,), methods=(CERTIFIED, "wrong"))
    scores = {(s.racer.method, s.family): s for s in score_families(effort, quiet)}
    assert scores["wrong", "ordinary"].wrong > 0
    assert scores["wrong", STRESS].wrong > 0
    assert scores["wrong", "ordinary"].radii.median > 1e-2
    certified, wrong = score_scenes(effort, quiet)
    assert wrong.wrong > certified.wrong == 0
    assert wrong.wrong_bytes > certified.wrong_bytes == 0


def test_all_methods_are_charted_unless_some_are_asked_for(monkeypatch):
    monkeypatch.setitem(METHODS, "new", METHODS["stable"])
    assert "new" in Effort().methods
    assert Effort().tenfold().rays == 10 * Effort().rays


def test_the_other_root_is_a_wrong_decision_and_a_rounded_one_is_not():
    problem = pose("ordinary", 64)
    truth = trace_bundles(Racer(CERTIFIED, NUMPY), problem.bundles)
    assert not errors_of(problem, truth).wrong.any()
    assert summary(errors_of(problem, truth).ulps).worst <= 8
    hit = problem.index >= 0
    rounded = truth._replace(t=np.where(hit, np.nextafter(problem.t, np.inf), np.inf))
    assert not errors_of(problem, rounded).wrong.any()
    assert summary(errors_of(problem, rounded).ulps) == (1, 1, 1)
    far = truth._replace(t=np.where(hit, problem.other, np.inf))
    np.testing.assert_array_equal(errors_of(problem, far).wrong, hit)
    missed = truth._replace(index=np.full_like(truth.index, -1))
    np.testing.assert_array_equal(errors_of(problem, missed).wrong, hit)


@pytest.mark.parametrize("method", [CERTIFIED, "haines", "double_double"])
@pytest.mark.parametrize("family", ["ordinary", "tied", "long and short"])
def test_both_backends_find_the_same(method, family):
    bundle = next(bundles(family, 64, 7))
    compiled, in_numpy = (trace(Racer(method, name), bundle) for name in (COMPILED, NUMPY))
    np.testing.assert_array_equal(compiled.index, in_numpy.index)
    np.testing.assert_array_equal(compiled.t, in_numpy.t)


def test_a_plan_is_on_the_backend_asked_for():
    from raytracer import backend, interpreter, plain

    scene = interpreter(ORDINARY_SCENE)
    assert plan_on(scene, Racer("haines", NUMPY), 8).path is plain
    assert plan_on(scene, Racer("haines", COMPILED), 8).path is backend.load()


def test_all_take_turns_each_time_another_first_and_the_slow_leave_early():
    seen = []

    def lane(name, seconds):
        return lambda turn: (seen.append((turn, name)), (seconds, turn))[1]

    racers = {Racer(name, NUMPY): lane(name, seconds) for name, seconds in (("a", 0.01), ("b", 60.0))}
    assert list(in_turns(racers, 4).values()) == [(0, 1, 2, 3), (0, 1)]
    assert seen == [(0, "a"), (0, "b"), (1, "b"), (1, "a"), (2, "a"), (3, "a")]


def test_pareto_keeps_what_nothing_beats():
    points = [(1, 9), (2, 5), (3, 5), (2, 7), (4, 1), (9, 0), (5, 2), (9, 0)]
    assert pareto(points) == [(1, 9), (2, 5), (4, 1), (9, 0)]
    assert pareto([]) == []


def test_the_shelf_lies_below_the_bound_and_all_rates():
    assert rule_of_three(300_000) == 10
    assert shelf_height([0, 50, 2e5], bound=10) == pytest.approx(1)
    assert shelf_height([0.02], bound=10) == pytest.approx(0.001)
    assert shelf_height([], bound=30) == pytest.approx(1)
    for bound in (0.3, 1, 3, 15.6, 99):
        assert shelf_height([], bound) < bound / 3


def test_names_cover_nothing_and_stay_inside():
    taken = [(90, 90, 110, 110), (60, 80, 90, 120)]
    box = free_box((100, 100), (30, 10), taken, (50, 50, 150, 150))
    for other in taken:
        assert box[2] <= other[0] or box[0] >= other[2] or box[3] <= other[1] or box[1] >= other[3]
    assert 50 <= box[0] < box[2] <= 150
    assert 50 <= box[1] < box[3] <= 150


def test_neighbours_form_chains():
    marks = [
        Mark(Racer(name, NUMPY), x, y, x, x) for name, x, y in (("c", 18, 0), ("a", 0, 0), ("b", 9, 0), ("d", 9, 50))
    ]
    assert [[m.racer.method for m in group] for group in neighbours(marks, 10)] == [["a", "b", "c"], ["d"]]


def test_matplotlib_is_loaded_only_to_draw():
    code = "import raytracer.chart, sys; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
