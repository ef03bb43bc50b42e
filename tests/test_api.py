"""What an importer sees: documented, typed, and shipped as such."""

import inspect
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import get_type_hints

import pytest
from optional import optional

import raytracer

ROOT = Path(__file__).parent.parent
PUBLIC = {name: getattr(raytracer, name) for name in raytracer.__all__}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
TABLES = ("METHODS", "STAGES")


def members(thing):
    """The functions and properties of a class that it defines itself, and are no secret."""
    return {
        name: getattr(member, "func", getattr(member, "fget", member))
        for name, member in vars(thing).items()
        if not name.startswith("_")
        and (inspect.isfunction(member) or type(member).__name__ in ("property", "cached_property"))
    }


@pytest.mark.parametrize("name", sorted(set(PUBLIC) - set(TABLES)))
def test_every_public_name_is_documented_and_typed(name):
    thing = PUBLIC[name]
    documented = {name: thing} | (members(thing) if inspect.isclass(thing) else {})
    for place, part in documented.items():
        text = inspect.getdoc(part) or ""
        assert text, place
        assert not text.startswith(f"{place}("), "a dataclass says this of itself"
        if inspect.isfunction(part):
            hints = get_type_hints(part)
            assert set(inspect.signature(part).parameters) - {"self"} <= set(hints), place
            assert "return" in hints, place


def test_the_types_are_shipped():
    shipped = PROJECT["tool"]["setuptools"]["package-data"]
    for package in ("raytracer", "sketch"):
        assert (ROOT / package / "py.typed").is_file()
        assert "py.typed" in shipped[package]


def test_every_package_is_shipped():
    packages = {path.parent.relative_to(ROOT).as_posix().replace("/", ".") for path in ROOT.glob("*/**/__init__.py")}
    ours = {package for package in packages if package.startswith(("raytracer", "sketch"))}
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == ours


def test_the_api_pages_are_made_without_a_warning(tmp_path):
    optional("pdoc")
    code = f"import sys; sys.path.insert(0, 'docs'); import api, pathlib; api.main(pathlib.Path({str(tmp_path)!r}))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    text = (tmp_path / "raytracer.html").read_text()
    for name in PUBLIC:
        assert f'<section id="{name}">' in text
    assert (tmp_path / "raytracer" / "scene.html").is_file()
