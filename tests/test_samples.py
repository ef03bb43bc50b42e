"""More than one sample a pixel: the mean of a larger picture, and only where it matters."""

import numpy as np
import pytest
from test_trace import PATHS

from raytracer import interpreter, render_scene
from raytracer.plan import make_plan
from raytracer.render import Cancelled, draw
from raytracer.samples import ADAPTIVE, SAMPLES, SIDE, differing, draw_samples

MIRRORS = interpreter("scenes/09_mirror_spheres.cli")


def means(large, side):
    height, width, _ = large.shape
    blocks = large.reshape(height // side, side, width // side, side, 3).astype(int)
    return np.floor(blocks.sum(axis=(1, 3)) / side**2 + 0.5).astype(int)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("stage", ["hit", "diffuse", "full"])
@pytest.mark.parametrize("sampling", ["corner", "centre"])
def test_samples_are_the_means_of_a_larger_picture(path, stage, sampling):
    plan = make_plan(MIRRORS, stage, 45, 37, sampling, path=PATHS[path])
    np.testing.assert_array_equal(draw_samples(plan, 1), draw(plan))
    for samples, side in ((4, 2), (16, 4), (64, 8)):
        large = draw(make_plan(MIRRORS, stage, 45 * side, 37 * side, sampling, path=PATHS[path]))
        np.testing.assert_array_equal(draw_samples(plan, samples), means(large, side))


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("path", PATHS)
def test_adaptive_takes_more_samples_where_neighbours_differ(path, threads):
    plan = make_plan(MIRRORS, "full", 61, 50, path=PATHS[path])
    single, found = draw(plan), draw_samples(plan, ADAPTIVE, threads=threads)
    more = differing(single)
    assert 0.02 < more.mean() < 0.5
    np.testing.assert_array_equal(found[~more], single[~more])
    np.testing.assert_array_equal(found[more], draw_samples(plan, SIDE**2)[more])


def test_differing_looks_at_all_eight_neighbours_and_no_farther():
    picture = np.zeros((7, 9, 3), np.uint8)
    picture[3, 4, 1] = 200
    assert np.argwhere(differing(picture)).tolist() == [[y, x] for y in (2, 3, 4) for x in (3, 4, 5)]
    picture[3, 4, 1] = 5
    assert not differing(picture).any()


def test_more_samples_come_closer_and_adaptive_closer_than_four():
    plan = make_plan(interpreter("scenes/11_star.cli"), "full", 120, 120)
    true = draw_samples(plan, 256).astype(float)
    errors = {samples: np.sqrt(((draw_samples(plan, samples) - true) ** 2).mean()) for samples in SAMPLES}
    assert errors[1] > 1.5 * errors[4] > 2 * errors[16] > 2 * errors[64] > 0
    assert errors[ADAPTIVE] < errors[16]


def test_draws_into_out_and_tells_how_far_it_is():
    out, seen = np.zeros((70, 50, 4), np.uint8), []
    found = render_scene(
        MIRRORS, "full", 50, 70, samples=4, out=out[:, :, :3], progress=lambda *what: seen.append(what)
    )
    assert np.shares_memory(found, out)
    np.testing.assert_array_equal(out[:, :, :3], render_scene(MIRRORS, "full", 50, 70, samples=4))
    assert (out[:, :, 3] == 0).all()
    assert [done for done, _, _ in seen] == list(range(1, seen[0][1] + 1))
    assert sorted(y for _, _, rows in seen for y in range(rows.start, rows.stop)) == list(range(70))
    seen.clear()
    render_scene(MIRRORS, "full", 50, 70, samples=ADAPTIVE, progress=lambda *what: seen.append(what))
    assert sorted(y for _, _, rows in seen for y in range(rows.start, rows.stop)) == list(range(70))
    for samples in (4, ADAPTIVE):
        with pytest.raises(Cancelled):
            render_scene(MIRRORS, "full", 50, 70, samples=samples, cancelled=lambda: True)


@pytest.mark.parametrize(
    ("samples", "stage", "message"),
    [(2, "full", "found 2 samples, expected one of 1, 4, 16, 64, 256, adaptive"), (0, "full", "found 0"),
     ("many", "full", "found 'many'"), (4, "edges", "stage edges is about single pixels"),
     (4, "error", "single pixels")],
)  # fmt: skip
def test_what_there_is_not(samples, stage, message):
    with pytest.raises(ValueError, match=message):
        render_scene(MIRRORS, stage, 8, 8, samples=samples)


def test_the_chart_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    from raytracer.chart_samples import chart_samples

    said = []
    paths = chart_samples(tmp_path, said.append, size=40, rounds=1)
    assert [path.name for path in paths] == ["chart-samples.csv", "chart-samples.png", "chart-samples.svg"]
    assert len(said) == 3
    assert "adaptive" in paths[2].read_text()
