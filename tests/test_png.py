"""Colours in files: in 8 bits, in 16, or as they are."""

import io
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from optional import optional
from PIL import Image
from pngs import decode_png, read_png
from test_trace import PATHS

from raytracer import STAGES, eye_hits, interpreter, save_png
from raytracer.image import Depth
from raytracer.output import write_picture
from raytracer.plan import make_plan
from raytracer.png import SMALLEST, Band, deflate_rows, write_png
from raytracer.render import draw
from raytracer.samples import draw_samples
from raytracer.tiled import Cargo, Picture

SPHERES = interpreter("scenes/04_many_spheres.cli")
MIRRORS = interpreter("scenes/09_mirror_spheres.cli")

pictures = st.sampled_from([np.uint8, np.uint16]).flatmap(
    lambda kind: arrays(kind, array_shapes(min_dims=2, max_dims=2, max_side=9).map(lambda shape: (*shape, 3)))
)


@given(pictures, st.sets(st.integers(1, 8)))
def test_a_png_in_bands_is_a_png(picture, cuts):
    """By the format's definition, and as PIL reads it, which keeps the upper 8 of 16 bits and checks less."""
    bands = [Band.unpack(deflate_rows(rows).pack()) for rows in np.split(picture, sorted(cuts)) if len(rows)]
    file, (height, width, _) = io.BytesIO(), picture.shape
    write_png(file, width, height, 8 * picture.itemsize, bands)
    np.testing.assert_array_equal(decode_png(file.getvalue()), picture)
    with Image.open(file) as image:
        np.testing.assert_array_equal(np.asarray(image), picture >> 8 * (picture.itemsize - 1))


def test_a_picture_in_16_bits_is_saved_as_it_is(tmp_path):
    picture = np.arange(0, 65536, 7, np.uint16)[:9000].reshape(60, 50, 3)
    save_png(tmp_path / "x.png", picture)
    np.testing.assert_array_equal(read_png(tmp_path / "x.png"), picture)


def test_a_picture_is_not_packed_smaller_than_the_refusal_expects():
    rows = np.zeros((2000, 2000, 3), np.uint8)
    assert len(deflate_rows(rows).deflated) >= rows.nbytes * SMALLEST
    assert len(zlib.compress(rows.tobytes(), 9)) >= rows.nbytes * SMALLEST


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("path", PATHS)
def test_16_bits_are_the_colours_of_the_stage_and_8_the_same_colours(stage, path):
    size = stage, 40, 30, "corner", "certified", PATHS[path]
    colours = draw(make_plan(MIRRORS, *size, depth=Depth.FLOAT))
    assert colours.dtype == np.float32
    words = draw(make_plan(MIRRORS, *size, depth=Depth.WORD))
    assert np.abs(words - np.floor(65535 * np.clip(colours.astype(float), 0, 1) + 0.5)).max() <= 1
    bytes_ = draw(make_plan(MIRRORS, *size))
    assert np.abs(bytes_ - words / 257).max() <= 0.5 + 1 / 257


def test_how_numbers_are_written():
    colours = np.array([-1.0, 0.0, 0.5, 1.0, 7.0, np.nan, np.inf, 1e300])
    assert Depth.BYTE.write(colours).tolist() == [0, 0, 128, 255, 255, 0, 255, 255]
    assert Depth.WORD.write(colours).tolist() == [0, 0, 32768, 65535, 65535, 0, 65535, 65535]
    largest = np.finfo(np.float32).max
    assert Depth.FLOAT.write(colours).tolist() == [-1.0, 0.0, 0.5, 1.0, 7.0, 0.0, largest, largest]


@pytest.mark.parametrize("samples", [4, 64, "adaptive"])
def test_samples_in_16_bits_are_finer_than_in_8(samples):
    coarse, fine = (make_plan(MIRRORS, "full", 40, 30, depth=depth) for depth in (Depth.BYTE, Depth.WORD))
    means = draw_samples(fine, samples)
    assert means.dtype == np.uint16
    off = np.abs(draw_samples(coarse, samples) - means / 257)
    assert np.quantile(off, 0.97) <= 1.01  # where a neighbour differs just by 16, adaptive may look or not


def test_openexr_holds_colours_depth_and_index(tmp_path):
    exr = optional("OpenEXR")
    picture, path = Picture(Cargo(SPHERES), "full", 40, 30, "centre", depth=Depth.FLOAT), tmp_path / "x.exr"
    path.write_bytes(b"old")
    write_picture(picture, path)
    channels = exr.File(str(path), separate_channels=True).channels()
    hits, colours = eye_hits(SPHERES, 40, 30, sampling="centre"), draw(picture.plan())
    found = {name: channel.pixels for name, channel in channels.items()}
    assert sorted(found) == ["B", "G", "R", "Z", "id"]
    for k, name in enumerate("RGB"):
        np.testing.assert_array_equal(found[name], colours[..., k])
    np.testing.assert_array_equal(found["Z"], hits.t.astype(np.float32))
    assert found["id"].dtype == np.uint32
    np.testing.assert_array_equal(found["id"].astype(np.int32), hits.index)
    assert np.isinf(found["Z"][hits.index < 0]).all()
    assert [each.name for each in tmp_path.iterdir()] == ["x.exr"]


def test_openexr_has_one_sample_a_pixel(tmp_path):
    optional("OpenEXR")
    with pytest.raises(ValueError, match="expected 1: a pixel of an OpenEXR file shows one shape"):
        write_picture(Picture(Cargo(SPHERES), samples=4, depth=Depth.FLOAT), tmp_path / "x.exr")


def test_without_openexr_the_message_says_what_brings_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "OpenEXR", None)
    with pytest.raises(ValueError, match="pip install OpenEXR"):
        write_picture(Picture(Cargo(SPHERES), depth=Depth.FLOAT), tmp_path / "x.exr")
