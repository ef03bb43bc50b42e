"""The figures: what is drawn for them, how turns are taken, who the peers are, and the tables and files they end in."""

import csv
import subprocess
import sys
from dataclasses import replace
from math import isnan, nan, radians, tan
from shutil import which

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from raytracer import METHODS, STAGES, bench, bench_chart, interpreter, peers, render_scene
from raytracer.__main__ import main
from raytracer.bench import (
    OURS,
    Check,
    Effort,
    Report,
    Section,
    Timing,
    affordable,
    cameras,
    drawing,
    in_decimals,
    interleaved,
    measure,
    pixels,
    random_rays,
    rows_of,
    same_picture,
    spread,
    thread_counts,
)
from raytracer.bench_chart import apart, as_markdown, duration, figure, markdown_table
from raytracer.interpreter import write_scene
from raytracer.peers import PEERS, Peer, first_fault, parse_seconds, small_size

LOOP = next(peer for peer in PEERS if peer.name == "Python loop")
SMALL = Effort(
    spheres=(3, 20),
    size=(32, 18),
    sizes=((16, 9), (32, 18)),
    middle=20,
    many=30,
    threads=(1, 2),
    methods=(10, (16, 9)),
    rays=(512, (5, 10)),
    parsed=40,
    checked=20,
    rounds=2,
    seconds=0.5,
    ray_seconds=0.2,
    parse_seconds=9.0,
)
MISSING = LOOP._replace(name="Nobody", why_not=lambda: "nobody is not installed")


def black(scene, width, height):
    """Draws nothing but black."""
    return lambda camera: np.zeros((height, width, 3), np.uint8)


@pytest.fixture(scope="module")
def report():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peers, "PEERS", (LOOP, MISSING))
        patch.setattr(peers, "why_not_povray", lambda: "povray is not on the PATH")
        said = []
        report = measure(SMALL, seed=2, progress=said.append)
        assert "parsing: 40 spheres, all digits" in said
        return report


def section(report, name):
    return next(section for section in report.sections if section.name == name)


# What is drawn


@pytest.mark.parametrize("n", [1_000, 20_000])
def test_spheres_are_spread_through_the_view(n):
    table = spread(n, 5).spheres
    depth = -table.centres[:, 2]
    up = depth * tan(radians(30))
    shares = [(depth - 3) / 20, table.centres[:, 1] / up / 2 + 0.5, table.centres[:, 0] / up * 9 / 16 / 2 + 0.5]
    shares.append(table.radii * n ** (1 / 3) / 1.6 - 0.3)
    for share in shares:  # each uniform from 0 to 1, and none depends on another
        np.testing.assert_allclose(np.quantile(share, [0, 0.25, 0.5, 0.75, 1]), [0, 0.25, 0.5, 0.75, 1], atol=0.06)
    np.testing.assert_allclose(np.corrcoef(shares), np.eye(4), atol=0.1)


def test_a_spread_scene_has_two_lights_and_64_colours_in_runs(tmp_path):
    scene = spread(3_000)
    write_scene(scene, tmp_path / "scene.cli")
    lines = (tmp_path / "scene.cli").read_text().splitlines()
    assert sum(line.startswith("surface") for line in lines) == 64
    assert sum(line.startswith("light") for line in lines) == len(scene.lights) == 2
    assert len(np.unique(scene.spheres.material)) == 64
    assert interpreter(tmp_path / "scene.cli") == scene


def test_the_seed_decides_what_is_spread():
    assert spread(50, 3) == spread(50, 3)
    assert spread(50, 3) != spread(50, 4)


def test_six_decimals_are_six_decimals():
    scene = spread(100)
    rounded = in_decimals(scene)
    assert all(len(repr(x).partition(".")[2]) <= 6 for x in rounded.spheres.centres.ravel().tolist())
    np.testing.assert_allclose(rounded.spheres.radii, scene.spheres.radii, rtol=0, atol=5.1e-7)
    assert rounded != scene


def test_the_camera_moves_between_pictures():
    scene, seen = spread(5), []
    lane = drawing(lambda camera: seen.append(camera) or np.zeros((2, 2, 3), np.uint8), scene, (2, 2))
    for turn in range(5):
        lane(turn)
    assert seen[0] == scene.camera == seen[4]
    assert len(set(seen)) == len(cameras(scene)) == 4


def test_random_rays_start_among_the_spheres_and_point_everywhere():
    origins, directions = random_rays(4_000, 1)
    assert origins.shape == directions.shape == (4_000, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    np.testing.assert_allclose(directions.mean(axis=0), 0, atol=0.05)
    assert -23 <= origins[:, 2].min() < -20 < -5 < origins[:, 2].max() <= -3
    assert not np.array_equal(origins, random_rays(4_000, 2)[0])


def test_threads_are_counted_in_doubles_up_to_all():
    assert thread_counts(1) == (1,)
    assert thread_counts(2) == (1, 2)
    assert thread_counts(6) == (1, 2, 4, 6)


# Taking turns


def test_a_timing_knows_its_quartiles():
    timing = Timing(9.0, (5.0, 1.0, 2.0, 4.0, 3.0))
    assert timing.quartiles == (2, 3, 4)
    assert timing.median == 3
    assert Timing(9.0, (5.0,)).quartiles == (5, 5, 5)


def lane_of(name, seconds, seen):
    return lambda turn: (seen.append((turn, name)), (seconds, 100 * turn + seconds))[1]


def test_all_are_called_first_and_then_once_a_round_each_time_another_one_first():
    seen = []
    timings = interleaved({name: lane_of(name, 0.1, seen) for name in "ab"}, rounds=2, seconds=9)
    assert seen == [(0, "a"), (0, "b"), (1, "a"), (1, "b"), (2, "b"), (2, "a")]
    assert timings["a"] == timings["b"] == Timing(0.1, (100.1, 200.1))


def test_who_has_used_its_share_of_time_sits_out():
    seconds = {"quick": 0.1, "middling": 0.4, "slow": 1.0, "slower": 30.0}
    timings = interleaved({name: lane_of(name, s, []) for name, s in seconds.items()}, rounds=4, seconds=0.9)
    assert {name: len(timing.rounds) for name, timing in timings.items()} == {
        "quick": 4, "middling": 2, "slow": 1, "slower": 1,
    }  # fmt: skip
    assert timings["slow"].rounds == (101.0,)
    assert timings["slower"] == Timing(30.0, (30.0,))


def test_a_smaller_picture_is_scaled_up():
    seconds, scaled = drawing(black(None, 4, 2), spread(1), (40, 20))(0)
    assert scaled == pytest.approx(100 * seconds)
    seconds, same = drawing(black(None, 4, 2), spread(1), (4, 2))(0)
    assert same == seconds


def test_ratios_are_of_medians():
    timings = {"a": Timing(0.0, (2.0, 1.0, 9.0)), "b": Timing(0.0, (4.0,))}
    assert [row.ratio for row in rows_of(timings, 1, None, 1, "a")] == [1, 2]
    assert [row.ratio for row in rows_of(timings, 1, None, 1, "a", speed=True)] == [1, 0.5]
    assert all(isnan(row.ratio) for row in rows_of(timings, 1, None, 1))


def test_slow_work_is_given_less(monkeypatch):
    given = []
    monkeypatch.setattr(bench, "clocked", lambda work: (1e-3 * work(), None))
    assert affordable(lambda count: given.append(count) or count, 100_000, seconds=3.0) == 1024
    assert max(given) == 1024
    assert affordable(lambda count: 0, 100_000, seconds=3.0) == 100_000
    assert affordable(lambda count: 0, 7, seconds=3.0) == 7


# What is measured


def test_there_is_a_row_for_everything(report):
    rows = {part.name: [(row.name, row.spheres) for row in part.rows] for part in report.sections}
    assert rows["spheres"] == [(name, n) for n in SMALL.spheres for name in (OURS, LOOP.name)]
    assert [row.size for row in section(report, "pixels").rows] == [size for size in SMALL.sizes for _ in range(2)]
    assert [name for name, _ in rows["threads"]] == ["1 thread", "2 threads"]
    assert [name for name, _ in rows["stages"]] == list(STAGES)
    assert [name for name, _ in rows["methods"]] == list(METHODS)
    assert rows["hits"] == [(name, n) for n in SMALL.spheres for name in ("eye_hits, out=", "eye_hits")]
    assert [n for _, n in rows["rays"]] == [5, 10]
    assert rows["parsing"] == [(f"{OURS}, all digits", 40), (f"{OURS}, 6 decimals", 40)]


def test_figures_are_of_what_was_done(report):
    for row in (row for part in report.sections for row in part.rows):
        assert row.timing.first > 0
        assert 1 <= len(row.timing.rounds) <= SMALL.rounds
        if row.size:
            assert row.things == pixels(row.size)
    assert [row.things for row in section(report, "parsing").rows] == [40, 40]
    for row in section(report, "rays").rows:
        assert row.name == f"{row.things:,} rays"
        assert 256 <= row.things <= 512
    for part, reference in (("spheres", OURS), ("stages", "diffuse"), ("methods", "haines")):
        own = [row for row in section(report, part).rows if row.name == reference]
        assert all(row.ratio == 1 for row in own)
        assert own


def test_only_the_loop_of_a_large_picture_is_extrapolated(monkeypatch):
    monkeypatch.setattr(peers, "_LOOP_TESTS", 30 * 20)
    monkeypatch.setattr(peers, "PEERS", (LOOP,))
    rows, checks = bench.against_peers(spread(20), (32, 18), SMALL)
    assert [(row.name, row.extrapolated) for row in rows] == [(OURS, False), (LOOP.name, True)]
    assert checks[0].size == small_size(20, 32, 18) != (32, 18)
    monkeypatch.setattr(peers, "_LOOP_TESTS", 10**9)
    rows, checks = bench.against_peers(spread(20), (32, 18), SMALL)
    assert not any(row.extrapolated for row in rows)
    assert checks[0].size == (32, 18)


def test_certainty_has_its_row_once_there_is_something_to_compare_with(monkeypatch, report):
    assert ("certainty" in {part.name for part in report.sections}) == (bench._unchecked(spread(1), (2, 2)) is not None)
    monkeypatch.setattr(bench, "_unchecked", lambda scene, size: bench.ours(scene, size, method="haines"))
    (part,) = bench.certainty(SMALL, 1, lambda text: None)
    assert [row.name for row in part.rows] == ["certified", "unchecked"]
    assert part.rows[1].ratio == 1


def test_every_benchmark_scene_is_checked(report):
    assert not report.faulty
    decided = [check.spheres for check in report.checks if "double_double" in check.what]
    assert decided == [3, 10, 20]  # and not the 30 of the threads
    assert max(Effort().spheres) == Effort().longer().checked > Effort().checked


def test_a_wrong_decision_is_a_fault(monkeypatch):
    right = bench.eye_hits

    def shifted(*arguments, method):
        hits = right(*arguments, method=method)
        return hits if method == "certified" else hits._replace(index=hits.index + (hits.index == hits.index.max()))

    monkeypatch.setattr(bench, "eye_hits", shifted)
    check = bench.same_decisions(spread(20), (32, 18))
    assert check.different > 0
    assert Report((), (check,), ()).faulty


# Peers


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_python_loop_draws_our_picture(seed):
    scene = spread(60, seed)
    for camera in cameras(scene):
        picture = peers.python_loop(scene, 40, 22)(camera)
        ours = render_scene(replace(scene, camera=camera), "diffuse", 40, 22)
        assert picture.shape == ours.shape
        assert len(np.unique(ours.reshape(-1, 3), axis=0)) > 50
        assert np.abs(picture.astype(int) - ours).max() <= 1


def test_the_small_picture_keeps_its_shape_and_its_cost():
    for n in (1, 10, 1_000, 100_000, 1_000_000):
        width, height = small_size(n, 1920, 1080)
        assert 1 <= width * height <= max(1, peers._LOOP_TESTS / n)
    assert small_size(1, 64, 36) == (64, 36)
    width, height = small_size(10, 1920, 1080)
    assert width / height == pytest.approx(16 / 9, rel=0.05)


def test_a_peer_that_draws_something_else_is_told_of():
    scene = spread(50)
    check = same_picture(LOOP._replace(name="Black"), black(scene, 16, 9)(scene.camera), scene)
    assert check == Check("Black's picture", 50, (16, 9), 16 * 9, True)
    assert Report((), (check,), ()).faulty
    assert not Report((), (check._replace(needed=False),), ()).faulty


def test_a_new_peer_is_one_row(monkeypatch):
    row = Peer("Black", "black", "by nobody", peers.nothing, black, 10, False)
    monkeypatch.setattr(peers, "PEERS", (row,))
    sections = list(bench.by_spheres(SMALL, 1, lambda text: None))
    (part,) = (thing for thing in sections if isinstance(thing, Section))
    assert [(row.name, row.spheres) for row in part.rows] == [(OURS, 3), ("Black", 3), (OURS, 20)]
    assert part.rows[1].ratio == pytest.approx(part.rows[1].timing.median / part.rows[0].timing.median)
    assert bench.about_peers(SMALL) == ("Black: black. Called as: by nobody; at most 10 spheres.",)


def test_a_peer_that_is_not_installed_is_named_with_the_reason(monkeypatch, report):
    assert "Nobody: nobody is not installed." in report.peers
    assert "Nobody" not in {row.name for part in report.sections for row in part.rows}
    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    reasons = {peer.name: peer.why_not() for peer in PEERS}
    assert reasons[LOOP.name] == ""
    assert reasons["Mitsuba 3"] == "mitsuba is not installed"
    assert "not installed" in reasons["embreex"]
    monkeypatch.setattr(peers, "find_spec", lambda name: "there")
    assert "no spheres" in peers.why_not_embreex()


def test_a_peer_that_ends_its_process_is_named_with_the_fault(monkeypatch):
    monkeypatch.setattr(peers, "find_spec", lambda name: "there")
    monkeypatch.setattr(peers, "_PROBE", "import os, sys; print('LLVM ERROR: no', file=sys.stderr); os._exit(3)")
    assert peers.why_not_mitsuba() == "mitsuba is installed, but cannot draw: LLVM ERROR: no"


def test_the_line_that_names_the_fault_is_found():
    trace = 'Traceback (most recent call last):\n  File "x.py", line 3\nImportError: no LLVM\n'
    assert first_fault(trace) == "ImportError: no LLVM"
    assert first_fault("\nsomething\n") == "something"
    assert first_fault("") == "it ended without a word"


def test_a_peer_apart_draws_what_it_draws_here():
    scene = spread(20)
    here, there = peers.python_loop(scene, 40, 22), peers.apart(peers.python_loop, scene, 40, 22)
    for camera in cameras(scene)[:2]:
        np.testing.assert_array_equal(there(camera), here(camera))


def test_mitsuba_draws_our_picture_where_it_can():
    pytest.importorskip("mitsuba")
    if fault := peers.why_not_mitsuba():
        pytest.skip(fault)
    scene = spread(300)
    draw = peers.mitsuba(scene, 160, 90)
    for camera in cameras(scene):
        ours = render_scene(replace(scene, camera=camera), "diffuse", 160, 90)
        assert (np.abs(draw(camera).astype(int) - ours).max(axis=2) > 1).sum() <= 5


def test_povray_is_given_the_same_spheres(tmp_path):
    scene = spread(100)
    peers.write_pov(scene, tmp_path / "scene.pov")
    lines = (tmp_path / "scene.pov").read_text().splitlines()
    assert sum(line.startswith("sphere") for line in lines) == 100
    assert sum(line.startswith("light_source") for line in lines) == 2
    assert sum(line.startswith("#default") for line in lines) == len(np.unique(scene.spheres.material))
    x, y, z = scene.spheres.centres[-1].tolist()
    assert lines[-1] == f"sphere {{ <{x!r}, {y!r}, {-z!r}>, {float(scene.spheres.radii[-1])!r} }}"


def test_povrays_statistics_are_read():
    text = "  Parse Time:       0 hours  0 minutes  4 seconds (4.181 seconds)\n  Trace Time: (9.000 seconds)\n"
    assert parse_seconds(text) == 4.181
    with pytest.raises(ValueError, match="Parse Error"):
        parse_seconds("starting\nParse Error: no such thing\n")


def test_povrays_parser_takes_its_turns(monkeypatch):
    monkeypatch.setattr(peers, "why_not_povray", lambda: "")
    monkeypatch.setattr(peers, "povray_parse_seconds", lambda path: 0.5 if "empty" in path.name else 2.5)
    timings = bench.parsed(spread(20), SMALL)
    assert timings["POV-Ray"] == Timing(2.0, (2.0, 2.0))
    assert 0 < timings[OURS].median < 2


@pytest.mark.skipif(not which("povray"), reason="povray is not on the PATH")
def test_povray_parses_what_it_is_given(tmp_path):
    peers.write_pov(spread(1_000), tmp_path / "scene.pov")
    assert 0 <= peers.povray_parse_seconds(tmp_path / "scene.pov") < 10


# Tables, files, command


def test_the_markdown_has_whole_tables_and_names_the_machine(report):
    text = as_markdown(report)
    assert bench_chart.machine() in text
    assert "numpy 2" in bench_chart.machine()
    for part in report.sections:
        head, marks, *rows = text.partition(f"## {part.title}\n\n")[2].partition("\n\n")[0].splitlines()
        assert len(rows) == len(part.rows)
        assert {line.count("|") for line in (head, marks, *rows)} == {10 + bool(part.against)}
        assert {len(line) for line in rows} == {len(head)}
        assert set(marks) == set("|-: ")
    assert "Every picture that must be the same is the same." in text
    assert "trace" in section(report, "spheres").remark
    wrong = report._replace(checks=(Check("x", 1, (1, 1), 1, True),))
    assert "must be right is not" in as_markdown(wrong)


def test_a_row_says_time_quartiles_and_speed():
    report = Report((section_of("spheres"),), (), ())
    ours, other = (line for line in as_markdown(report).splitlines() if "4×2" in line)
    cells = [cell.strip() for cell in ours.strip("|").split("|")]
    assert cells == [OURS, "3", "4×2", "105 ms", "102 … 108", "13,125,000", "7.6e-05", "200 ms", "2", "1"]
    assert [cell.strip() for cell in other.strip("|").split("|")] == ["B (extrapolated)", *cells[1:-1], ""]


def test_a_table_lines_up():
    assert markdown_table(["a", "bb"], [["ccc", "d"]]) == ["| a   | bb |", "| --- | -: |", "| ccc |  d |"]


def test_numbers_read_well():
    assert [figure(x) for x in (12345.6, 99.94, 1.5, 0.0123, 0.00001234)] == [
        "12,346",
        "99.9",
        "1.5",
        "0.0123",
        "1.2e-05",
    ]
    assert [duration(x) for x in (0.0123, 9.9, 59, 7_200, 864_000)] == ["12.3 ms", "9,900 ms", "59 s", "2 h", "10 days"]


def test_all_files_are_written(report, tmp_path):
    paths = bench_chart.write(tmp_path / "new", report)
    assert {path.name for path in paths} == {"bench.md", "bench.csv", "bench.png", "bench.svg"}
    assert sorted(paths) == sorted((tmp_path / "new").iterdir())
    assert all(path.stat().st_size > 1000 for path in paths)
    with (tmp_path / "new" / "bench.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert len(table) == sum(len(part.rows) for part in report.sections) + len(report.checks)
    for row in table:
        assert None not in row.values()
        if row["section"] == "check":
            assert row["different"] == "0"
        else:
            low, median, high = (float(row[name]) for name in ("quarter_ms", "median_ms", "three_quarters_ms"))
            assert 0 < low <= median <= high


def test_the_chart_has_a_line_for_each_competitor(report, monkeypatch, tmp_path):
    kept = []
    monkeypatch.setattr(bench_chart, "save", lambda figure, stem: kept.append(figure) or [])
    bench_chart.draw_chart(tmp_path / "bench", report)
    for axes, name in zip(kept[0].axes, ("spheres", "pixels"), strict=True):
        lines = {line.get_label(): line for line in axes.lines}
        assert {OURS, LOOP.name} <= set(lines)
        expected = [row.timing.median for row in section(report, name).rows if row.name == OURS]
        np.testing.assert_allclose(lines[OURS].get_ydata(), expected)
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        assert {OURS, LOOP.name} <= {text.get_text() for text in axes.texts}


def test_names_keep_apart_and_in_order():
    assert apart({"a": 0.0, "b": 100.0}, 10) == {"a": 0, "b": 100}
    assert apart({"b": 12.0, "a": 10.0}, 10) == {"a": 6, "b": 16}
    found = apart({"a": 0.0, "b": 1.0, "c": 2.0, "d": 9.0}, 10)
    assert list(found) == ["a", "b", "c", "d"]
    assert np.diff(list(found.values())).min() == pytest.approx(10)
    assert np.mean(list(found.values())) == pytest.approx(3)


def test_the_command_prints_the_tables_and_writes_the_files(monkeypatch, tmp_path, capsys):
    good = Report((section_of("spheres"), section_of("pixels")), (Check("x", 3, (4, 2), 0, True),), ("A: b.",))
    monkeypatch.setattr(bench, "measure", lambda effort, seed, progress: good)
    assert main(["bench", "-o", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert as_markdown(good) in said
    assert str(tmp_path / "bench.svg") in said
    bad = good._replace(checks=(Check("x", 3, (4, 2), 1, True),))
    monkeypatch.setattr(bench, "measure", lambda effort, seed, progress: bad)
    assert main(["bench", "-o", str(tmp_path)]) == 1


def section_of(name):
    timing = Timing(0.2, (0.1, 0.11))
    rows = (bench.Row(OURS, 3, (4, 2), 8, timing, 1.0), bench.Row("B", 3, (4, 2), 8, timing, nan, True))
    return Section(name, f"By {name}", "ray", "ratio", "", rows)


def test_effort_and_seed_go_on_to_the_measurement(monkeypatch, tmp_path):
    asked = []

    def noted(effort, seed, progress):
        asked.append((effort, seed))
        raise ValueError("enough")

    monkeypatch.setattr(bench, "measure", noted)
    assert main(["bench", "-o", str(tmp_path)]) == 1
    assert main(["bench", "-o", str(tmp_path), "--long", "--seed", "7"]) == 1
    (short, first), (long, second) = asked
    assert (first, second) == (1, 7)
    assert long.rounds > short.rounds
    assert long == short.longer()


def test_a_scene_file_can_be_written_alone(tmp_path, capsys):
    out = tmp_path / "scene.cli"
    assert main(["bench", "--write-scene", "50", str(out), "--seed", "3"]) == 0
    assert interpreter(out) == spread(50, 3)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.cli"]
    assert main(["bench", "--write-scene", "many", str(out)]) == 1
    assert "found 'many'" in capsys.readouterr().err
    assert main(["bench", "--write-scene", "5", str(tmp_path / "no" / "scene.cli")]) == 1


def test_no_peer_and_no_matplotlib_is_loaded_before_it_is_needed():
    code = (
        "import raytracer.bench, sys; sys.exit(any(name in sys.modules for name in ('matplotlib', 'mitsuba', 'numba')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
