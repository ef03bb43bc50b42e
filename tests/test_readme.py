"""What the README says is so."""

import re
from pathlib import Path

import numpy as np

from raytracer import STAGES, render_scene
from raytracer.interpreter import interpret
from raytracer.stages import Stage
from sketch.controls import keys_as_markdown

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_the_table_of_keys_is_the_windows():
    assert keys_as_markdown() in README


def test_the_map_names_every_module_and_no_other():
    modules = {
        path.relative_to(ROOT).as_posix()
        for folder in ("raytracer", "sketch")
        for path in (ROOT / folder).rglob("*.py")
    }
    modules = {module for module in modules if not module.endswith("__init__.py") and "templates/" not in module}
    assert set(re.findall(r"^\| `([\w/]+\.py)` \|", README, re.MULTILINE)) == modules


def test_pictures_and_scenes_exist():
    for path in [*re.findall(r"!\[.*?\]\((.*?)\)", README), *re.findall(r"scenes/\w+\.cli", README)]:
        assert (ROOT / path).is_file(), path


def test_the_python_examples_run(monkeypatch):
    core, stage = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(ROOT)
    names: dict = {}
    exec(core, names)
    assert names["hits"].t.tolist() == [4.0]
    exec("import numpy as np\nfrom raytracer import Block\n" + stage.partition("STAGES")[0], names)
    monkeypatch.setitem(STAGES, "checker", Stage("c", names["checker"], "a checkered world", needs_normals=True))
    scene = interpret("surface 1 1 1 0 0 0 0 0 0 1 0\nsphere 1 0 0 -4")
    assert len(np.unique(render_scene(scene, "checker").reshape(-1, 3), axis=0)) > 3
