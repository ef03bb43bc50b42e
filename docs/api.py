"""Makes pages from the docstrings of `raytracer` and its modules: `python docs/api.py`, then open docs/api/index.html.

Takes pdoc: `python -m pip install pdoc`.
"""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import get_type_hints

ROOT = Path(__file__).resolve().parent.parent


def modules(package: str) -> Iterator[str]:
    """What is in a package, but the kernels, which repeat what is in numpy elsewhere, and the command line."""
    folder = ROOT.joinpath(*package.split("."))
    for each in iter_modules([str(folder)], f"{package}."):
        if not each.name.endswith((".kernels", "__")):
            yield each.name


def resolve(name: str) -> None:
    """Write out the types of a module's named tuples, which pdoc looks up where tuples are made, not in the module."""
    for thing in vars(import_module(name)).values():
        if isinstance(thing, type) and issubclass(thing, tuple) and hasattr(thing, "_fields"):
            thing.__new__.__annotations__ = get_type_hints(thing)


def main(folder: Path = ROOT / "docs" / "api") -> None:
    sys.path.insert(0, str(ROOT))
    try:
        import pdoc
    except ModuleNotFoundError:
        sys.exit("this takes pdoc: python -m pip install pdoc")
    top = list(modules("raytracer"))
    for name in ("raytracer", *top, *modules("raytracer.report")):
        resolve(name)
    top.remove("raytracer.interpreter")  # comes with the package, one of whose public names it has
    pdoc.render.configure(show_source=False, footer_text="raytracer-sketch")
    pdoc.pdoc("raytracer", *top, output_directory=folder)


if __name__ == "__main__":
    main()
