"""The report: its pictures are those that are drawn, its figures those measured, and its page needs no other file."""

import csv
import re
import subprocess
import sys
from base64 import b64decode
from io import BytesIO
from math import isnan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from optional import optional
from PIL import Image

from raytracer import METHODS, STAGES, backend, bench, interpreter, measure, plain, render_scene
from raytracer.__main__ import main
from raytracer.measure import STRESS
from raytracer.offsets import OFFSETS
from raytracer.peers import PEERS
from raytracer.report import page, plots
from raytracer.report.figures import Figures, Score, measure_figures, read_figures
from raytracer.report.gallery import draw_gallery, draw_tiles, find_scenes, first_comment
from raytracer.report.plots import Axis

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
SCENE = "surface 1 .5 0 0 0 0 0 0 0 1 0\nsphere 1 0 0 -4\n"
NOTHING = Figures([], [], [], [])


@pytest.fixture(autouse=True)
def in_numpy(monkeypatch):
    """The bits are the same, and no method's kernel has to be compiled."""
    monkeypatch.setattr(backend, "_loaded", plain)
    monkeypatch.setattr(bench, "compile_all", lambda: None)


@pytest.fixture
def folder(tmp_path):
    """A scene, a scene in a folder within, and a file that is none."""
    (tmp_path / "within").mkdir()
    (tmp_path / "10_last.cli").write_text(f"# Two <b>words</b> & more. And so on.\n{SCENE}")
    (tmp_path / "2_wrong.cli").write_text("# Not to be read.\nspere 1 0 0 0\n")
    (tmp_path / "within" / "1_first.cli").write_text(SCENE)
    return tmp_path


def picture_of(source):
    kind, _, data = source.partition(",")
    assert kind == "data:image/webp;base64"
    return np.asarray(Image.open(BytesIO(b64decode(data))))


# The gallery


def test_scenes_come_in_the_order_of_their_names_and_those_within_last(folder):
    assert [path.stem for path in find_scenes(folder)] == ["2_wrong", "10_last", "1_first"]


def test_a_tile_is_what_each_of_its_methods_draws_and_no_method_is_left_out():
    scene = interpreter(ROOT / "scenes" / "hard" / "07_tangent_rows.cli")
    for stage in STAGES:
        tiles = draw_tiles(scene, stage, 16)
        assert sorted(method for tile in tiles for method in tile.methods) == sorted(METHODS)
        assert tiles[0].methods[0] == "certified"
        for tile in tiles:
            for method in tile.methods:
                expected = render_scene(scene, stage, 16, 16, method=method)
                np.testing.assert_array_equal(picture_of(tile.source), expected)
        assert len({tile.picture.tobytes() for tile in tiles}) == len(tiles)


def test_wrong_pixels_are_counted_and_certified_has_none(tmp_path):
    (tmp_path / "hard.cli").write_text((ROOT / "scenes" / "hard" / "01_far_small_sphere.cli").read_text())
    (entry,) = draw_gallery(tmp_path, 16)
    wrong = entry.wrong_by_method()
    assert wrong["textbook"].wrong > 0
    assert "certified" not in wrong


def test_a_scene_that_cannot_be_read_stands_in_its_place_with_its_message(folder):
    entries = draw_gallery(folder, 8)
    assert [entry.name for entry in entries] == ["2_wrong", "10_last", "within/1_first"]
    assert entries[0].fault.startswith("2_wrong.cli:2:1: ")
    assert not entries[0].tiles
    assert entries[1].tiles
    assert not entries[1].fault


def test_a_scene_is_described_by_its_first_sentence_or_else_by_its_name(tmp_path, folder):
    assert first_comment(folder / "10_last.cli") == "Two <b>words</b> & more."
    assert first_comment(folder / "within" / "1_first.cli") == "1 first"
    assert first_comment(tmp_path / "not_there.cli") == "not there"


# Figures


def test_measured_figures_are_read_back_as_the_tables_say(monkeypatch):
    monkeypatch.setattr("raytracer.report.figures._SAMPLES_SIZE", 16)
    effort = measure.Effort(
        rays=128, ordinary_rays=128, rounds=1, timed_rays=64, size=16, methods=("certified", "textbook32"),
        families=("ordinary", "far small"), backends=("numpy",), scenes=(measure.ORDINARY_SCENE,),
    )  # fmt: skip
    small = bench.Effort(
        spheres=(3,), size=(16, 9), sizes=((16, 9),), middle=3, many=3, methods=(3, (16, 9)), rounds=1, seconds=0.01,
        threads=(1,), checked=0,
    )  # fmt: skip
    said = []
    found = measure_figures(said.append, effort, small, 200)
    assert found.measured
    assert not found.missing
    assert said
    far = next(s for s in found.scores if (s.place, s.method) == ("far small", "textbook32"))
    assert (far.kind, far.precision, far.backend, far.cases) == ("family", "float32", "numpy", 128)
    assert 0 < far.wrong <= 128
    assert far.time_quarter <= far.time_median <= far.time_three_quarters
    assert {t.section for t in found.timings} >= {"spheres", "pixels", "threads", "stages", "methods"}
    assert {s.samples for s in found.samples} == {"1", "4", "16", "64", "adaptive"}
    one, many = (next(s for s in found.samples if s.samples == samples) for samples in ("1", "64"))
    assert many.error < one.error
    assert many.milliseconds > one.milliseconds > 0
    assert {c.fault for c in found.contacts} == {"self-hit", "missed"}


def test_where_the_projects_scenes_are_not_there_their_charts_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(measure, "SCENES", tmp_path)
    monkeypatch.setattr("raytracer.report.figures._BENCH_PARTS", ())
    effort = measure.Effort(
        rays=64, rounds=1, timed_rays=64, methods=("certified",), families=("ground",), backends=("numpy",),
        scenes=(tmp_path / "none.cli",),
    )  # fmt: skip
    found = measure_figures(effort=effort, contact_rays=60)
    assert not found.samples
    assert {s.kind for s in found.scores} == {"family"}
    assert not any(chart.panels for group in page.charts(found) for chart in group.charts if chart.name == "scenes")


def test_the_tables_in_docs_can_be_read():
    found = read_figures(DOCS)
    assert not found.measured
    assert {s.method for s in found.scores} == set(METHODS)
    assert all(t.median_ms > 0 for t in found.timings if t.section != "check")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (None, "found no figures, expected chart.csv"),
        ("scene,samples\n", "chart-samples.csv:1: found no column 'milliseconds', expected scene, samples"),
        ("scene,samples,milliseconds,error\na,1,2,many\n", "samples.csv:2: found 'many' as error, expected a number"),
        ("scene,samples,milliseconds,error\na,1\n", "chart-samples.csv:2: "),
    ],
)  # fmt: skip
def test_figures_that_cannot_be_read_are_refused_in_one_line(tmp_path, line, message):
    if line is not None:
        (tmp_path / "chart-samples.csv").write_text(line)
    if message.endswith("2: "):
        assert isnan(read_figures(tmp_path).samples[0].error)
        return
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        read_figures(tmp_path)
    assert "\n" not in str(caught.value)


# Charts


@given(st.lists(st.floats(1e-12, 1e12), min_size=2, max_size=9), st.booleans(), st.booleans())
def test_larger_numbers_lie_farther_along_and_nothing_on_the_shelf(values, up, shelf):
    low, high = min(values) / 2, max(values) * 2
    start, end = (300.0, 10.0) if up else (10.0, 300.0)
    axis = Axis("", low, high, start, end, "none" if shelf else "")
    places = [abs(axis.at(value) - start) for value in sorted(values)]
    assert places == sorted(places)
    assert axis.at(low) == axis.at(low / 2) != axis.at(high) == axis.at(2 * high) == end
    assert all(0 <= place <= 290 for place in places)
    assert all(axis.at(0) != axis.at(value) for value in values) or not shelf
    assert 1 <= len(axis.ticks) <= 9


def test_every_figure_of_the_tables_has_its_mark_and_its_sentence():
    found = read_figures(DOCS)
    panels = plots.ray_panels(found.scores)
    assert panels[0].name == STRESS
    assert len(panels) == len({s.place for s in found.scores if s.kind == "family"})
    assert sum(len(panel.marks) for panel in panels) == sum(s.kind == "family" for s in found.scores)
    ground = next(panel for panel in panels if panel.name == "ground")
    with (DOCS / "chart.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["place"] == "ground"]
    for row, mark in zip(rows, ground.marks, strict=True):
        assert mark.sentence.startswith(f"{row['method']}, {row['backend']}: ")
        assert (f"none of {int(row['cases']):,} " in mark.sentence) == (row["wrong"] == "0")
        assert mark.hollow == (row["precision"] == "float32")
    assert len(plots.bench_panels(found.timings)) == 2
    assert len(plots.error_panels(found.scores)) == 2


def test_tables_say_what_the_files_say():
    found = read_figures(DOCS)
    tables = {table.title: table for table in page.bench_tables(found.timings)}
    first, _, _ = (DOCS / "bench.md").read_text().partition("| raytracer ")[2].partition("\n")
    assert tables["By spheres"].rows[0][1:4] == [cell.strip() for cell in first.split("|")[1:4]]
    assert "Checked" in tables
    families, rows = page.family_table(found.scores)
    assert all(len(cells) == len(families) for cells in rows.values())
    assert {cell.text for cell in rows["certified"]} == {"0"}


# The page


def made(folder, figures=NOTHING):
    optional("jinja2")
    return page.page("folder", draw_gallery(folder, 8), figures, 8, (1.0, 2.0))


def test_the_page_needs_no_other_file_and_names_no_path(folder):
    text = made(folder, read_figures(DOCS))
    sources = re.findall(r"(?:src|href)=\"(.*?)\"", text)
    assert all(source.startswith(("data:", "#")) for source in sources)
    assert not re.search(r"https?://|@import|url\(", text)
    assert str(folder) not in text
    assert str(Path.home()) not in text
    assert "1 of 14 methods are right" in text


def test_what_files_say_cannot_become_markup(folder):
    evil = folder / "<script>alert(1)<script>.cli"
    evil.write_text("# <script>alert(2)</script> \"'> <img src=x onerror=alert(3)>.\n<script>\n")
    text = made(folder)
    assert "<script>alert" not in text
    assert "<img src=x" not in text
    assert "Two &lt;b&gt;words&lt;/b&gt; &amp; more." in text


def test_an_alt_text_says_scene_stage_and_method(folder):
    alts = re.findall(r"<img [^>]*?alt=\"([^\"]+)\"", made(folder))
    about = "Two &lt;b&gt;words&lt;/b&gt; &amp; more. Stage {}, drawn by {}"
    for stage in STAGES:
        starts = tuple(about.format(stage, who) for who in ("certified", "every method"))
        assert any(alt.startswith(starts) for alt in alts)
    assert about.format("cost", "every method.") in alts


def test_the_command_writes_the_page(folder, tmp_path, capsys):
    optional("jinja2")
    out = tmp_path / "out.html"
    assert main(["report", str(folder), "-o", str(out), "--figures", str(DOCS), "--tile", "8"]) == 0
    text = out.read_text()
    assert text.startswith("<!DOCTYPE html>")
    assert "3 scenes" in text
    assert "may be another machine" in text
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "nowhere: found no folder, expected scenes"),
        (["tests"], "tests: found no scene (.cli), expected scenes"),
        (["scenes", "--figures", "tests"], "tests: found no figures"),
        (["scenes", "-o", "no/such/folder.html"], "no such folder"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(words, message, monkeypatch, capsys, tmp_path):
    optional("jinja2")
    monkeypatch.chdir(ROOT)
    out = [] if "-o" in words else ["-o", str(tmp_path / "x.html")]
    assert main(["report", *words, *out]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_without_jinja2_one_line_says_how_to_get_it(folder, monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    assert main(["report", str(folder), "-o", str(tmp_path / "x.html")]) == 1
    assert "pip install jinja2" in capsys.readouterr().err


def test_the_core_loads_none_of_it():
    code = (
        "import sys, raytracer.__main__\n"
        "print([name for name in sys.modules if name.startswith(('jinja2', 'raytracer.report'))])"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_scores_are_read_by_the_names_of_columns(tmp_path):
    """A column that is moved, or new, changes nothing."""
    rows = list(csv.DictReader((DOCS / "chart.csv").open(newline="")))[:3]
    names = [*reversed(rows[0]), "new"]
    with (tmp_path / "chart.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, names)
        table.writeheader()
        table.writerows(row | {"new": "x"} for row in rows)
    found = read_figures(tmp_path).scores
    assert found == read_figures(DOCS).scores[:3]
    assert isinstance(found[0], Score)


def luminance(colour):
    """W3C, Web Content Accessibility Guidelines 2.2: relative luminance of #rgb or #rrggbb."""
    digits = colour.removeprefix("#")
    width = len(digits) // 3
    bands = [int((digits[k * width : (k + 1) * width] * 2)[:2], 16) / 255 for k in range(3)]
    linear = [band / 12.92 if band <= 0.04045 else ((band + 0.055) / 1.055) ** 2.4 for band in bands]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_every_colour_of_a_mark_is_there_and_stands_out_in_light_and_dark():
    css = (ROOT / "raytracer" / "report" / "page.css").read_text()
    light, dark = (dict(re.findall(r"--([a-z]+): (#[0-9a-f]+);", block)) for block in css.split("@media", 2)[:2])
    used = {plots.colour_of(name) for name in (*METHODS, *OFFSETS, *(peer.name for peer in PEERS), "even", "adaptive")}
    for colours in (light, light | dark):
        for name in used:
            low, high = sorted(luminance(colours[key]) for key in (name, "card"))
            assert (high + 0.05) / (low + 0.05) >= 4.5, (name, colours[name])
