"""What a scene file says, and nothing else: no picture size, no stage, no way of tracing.

Small things (camera, lights) are plain frozen dataclasses. Whatever a file may hold a million of (materials, spheres,
triangles) is held as arrays behind the face of a sequence: `scene.spheres[i]` is a `Sphere`, made when asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, overload

import numpy as np

from raytracer.arrays import aligned
from raytracer.notebook import counted, scene_as_html
from raytracer.units import unit_of

Vector = tuple[float, float, float]
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """Where the eye is and how it looks: frame u (right), v (up), w (backwards); fov is vertical, in degrees.

    The ray of column x and row y of W × H pixels is eye + t · (U·u + V·v − w / tan(fov / 2)), with U = (2x − W) / H and
    V = (H − 2y) / H; it goes through the pixel's upper left corner. No vector of the frame need be of length 1.
    """

    eye: Vector = (0.0, 0.0, 0.0)
    u: Vector = (1.0, 0.0, 0.0)
    v: Vector = (0.0, 1.0, 0.0)
    w: Vector = (0.0, 0.0, 1.0)
    fov: float = 60.0


@dataclass(frozen=True)
class Light:
    """A point light; its light does not fade with distance. A colour is red, green, blue: 1 is full, more may be."""

    position: Vector
    colour: Colour


@dataclass(frozen=True)
class Material:
    """How a shape answers light: the words of the `surface` command, in its order.

    At stage `full`: ambient + k_refl · (the mirrored ray's colour) + Σ over unshadowed lights of light · (diffuse ·
    max(0, N·L) + specular · max(0, H·N)^power), with H between L and the direction to the eye (J. Blinn, Models of
    Light Reflection for Computer Synthesized Pictures, 1977).
    """

    diffuse: Colour = (0.0, 0.0, 0.0)
    ambient: Colour = (0.0, 0.0, 0.0)
    specular: Colour = (0.0, 0.0, 0.0)
    power: float = 1.0
    k_refl: float = 0.0


@dataclass(frozen=True)
class Sphere:
    """Radius and centre in the scene's unit of length; the radius is above 0."""

    radius: float
    centre: Vector
    material: Material


@dataclass(frozen=True)
class Triangle:
    """Three vertices that do not lie on one line, in the scene's unit of length."""

    vertices: tuple[Vector, Vector, Vector]
    material: Material


Shape = Sphere | Triangle


Row = TypeVar("Row")


def vector(row: np.ndarray) -> Vector:
    """An array of three numbers as a tuple."""
    x, y, z = row.tolist()
    return x, y, z


def _made_anew(thing: Any) -> tuple[object, ...]:
    """How to unpickle a dataclass: by making it anew, so that arrays lie as they must, and nothing kept goes along."""
    return type(thing), tuple(getattr(thing, each.name) for each in fields(thing) if each.init)


class _Table(Sequence[Row]):
    """A read-only sequence whose rows live in arrays; a subclass says which arrays, and how row i is made of them."""

    def __post_init__(self) -> None:
        for array in self.arrays():
            array.flags.writeable = False

    def arrays(self) -> list[np.ndarray]:
        raise NotImplementedError

    def _row(self, i: int) -> Row:
        raise NotImplementedError

    def __reduce__(self) -> tuple[object, ...]:
        return _made_anew(self)

    def __len__(self) -> int:
        return len(self.arrays()[0])

    @overload
    def __getitem__(self, i: int) -> Row: ...
    @overload
    def __getitem__(self, i: slice) -> Sequence[Row]: ...
    def __getitem__(self, i: int | slice) -> Row | Sequence[Row]:
        if isinstance(i, slice):
            return [self._row(k) for k in range(*i.indices(len(self)))]
        return self._row(range(len(self))[i])

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(a, b) for a, b in zip(self.arrays(), other.arrays(), strict=True))

    def __hash__(self) -> int:
        return hash((type(self), len(self)))

    def __repr__(self) -> str:
        return f"<{len(self)} {type(self).__name__.lower()}>"


@dataclass(frozen=True, eq=False, repr=False)
class Materials(_Table[Material]):
    """Materials as the columns dr dg db  ar ag ab  sr sg sb  power  k_refl of one array."""

    table: np.ndarray = field(default_factory=lambda: np.empty((0, 11)))  # (m, 11) float64

    def arrays(self) -> list[np.ndarray]:
        return [self.table]

    @cached_property
    def diffuse(self) -> np.ndarray:
        """The diffuse colours alone, as rows r, g, b, 0: float64 (m, 4)."""
        rows = np.zeros((len(self.table), 4))
        rows[:, :3] = self.table[:, :3]
        return rows

    @cached_property
    def diffuse_range(self) -> tuple[float, float]:
        """The smallest and the largest number among the diffuse colours; 0 if there is none."""
        colours = self.table[:, :3]
        return (float(colours.min()), float(colours.max())) if len(colours) else (0.0, 0.0)

    def _row(self, i: int) -> Material:
        row = self.table[i]
        return Material(vector(row[0:3]), vector(row[3:6]), vector(row[6:9]), float(row[9]), float(row[10]))


@dataclass(frozen=True, eq=False, repr=False)
class Spheres(_Table[Sphere]):
    """Spheres as arrays. `order` is the place of each among all shapes of the file, counted from 0, ascending.

    Radii and centres are kept as one array, in which a sphere is a row: whoever looks at it finds all four together.
    """

    radii: np.ndarray = field(default_factory=lambda: np.empty(0))  # (n,) float64
    centres: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # (n, 3) float64
    material: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))  # (n,) int32, row of `materials`
    order: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))  # (n,) int32
    materials: Materials = Materials()
    balls: np.ndarray = field(init=False)  # (n rounded up to eights, 4) float64: x, y, z, radius; NaN in rows to spare

    def __post_init__(self) -> None:
        balls = pack_balls(self.centres, self.radii)
        balls.flags.writeable = False
        object.__setattr__(self, "balls", balls)
        object.__setattr__(self, "centres", self.balls[: len(self.radii), :3])
        object.__setattr__(self, "radii", self.balls[: len(self.radii), 3])
        super().__post_init__()

    def arrays(self) -> list[np.ndarray]:
        return [self.radii, self.centres, self.material, self.order]

    @cached_property
    def largest(self) -> float:
        """The largest number among centres and radii, without its sign; 0 if there is none."""
        return float(np.abs(self.balls[: len(self)]).max(initial=0.0))

    @cached_property
    def smallest(self) -> float:
        """The smallest of them that is not 0; +inf if there is none."""
        return _smallest(self.balls[: len(self)])

    def _row(self, i: int) -> Sphere:
        return Sphere(float(self.radii[i]), vector(self.centres[i]), self.materials[self.material[i]])


def pack_balls(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Spheres as rows x, y, z, radius: float64 (n rounded up to eights, 4), NaN in rows to spare."""
    count, rows = len(radii), -(-len(radii) // 8) * 8
    balls = aligned(4 * rows, np.float64).reshape(rows, 4)
    balls[:count, :3], balls[:count, 3], balls[count:] = centres, radii, np.nan
    return balls


@dataclass(frozen=True, eq=False, repr=False)
class Triangles(_Table[Triangle]):
    """Triangles as arrays, `order` as for `Spheres`."""

    vertices: np.ndarray = field(default_factory=lambda: np.empty((0, 3, 3)))  # (n, 3, 3) float64: vertex, axis
    material: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))  # (n,) int32, row of `materials`
    order: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))  # (n,) int32
    materials: Materials = Materials()

    def arrays(self) -> list[np.ndarray]:
        return [self.vertices, self.material, self.order]

    @cached_property
    def corner_numbers(self) -> np.ndarray:
        """A number for each corner, equal for equal ones: (n, 3) int64."""
        corners = np.ascontiguousarray(self.vertices + 0.0).reshape(-1, 3)  # + 0: no two zeros
        _, numbers = np.unique(corners.view("V24"), return_inverse=True)
        return np.asarray(numbers).reshape(-1, 3)

    @cached_property
    def largest(self) -> float:
        """The largest number among the corners, without its sign; 0 if there is none."""
        return float(np.abs(self.vertices).max(initial=0.0))

    @cached_property
    def smallest(self) -> float:
        """The smallest of them that is not 0; +inf if there is none."""
        return _smallest(self.vertices)

    def _row(self, i: int) -> Triangle:
        first, second, third = self.vertices[i]
        return Triangle((vector(first), vector(second), vector(third)), self.materials[self.material[i]])


def _smallest(numbers: np.ndarray) -> float:
    return float(np.abs(numbers).min(where=numbers != 0.0, initial=np.inf))


@dataclass(frozen=True, repr=False)
class Scene:
    """Everything a `.cli` file says. Two scenes are equal when they say the same, wherever they were read from.

    `spheres`, `triangles` and `materials` are sequences, held as arrays; `len(scene)` counts all shapes. In a notebook
    a scene is shown as a table.
    """

    camera: Camera = Camera()
    background: Colour = (0.0, 0.0, 0.0)
    lights: tuple[Light, ...] = ()
    materials: Materials = Materials()
    spheres: Spheres = Spheres()
    triangles: Triangles = Triangles()
    path: Path | None = field(default=None, compare=False)

    def __reduce__(self) -> tuple[object, ...]:
        return _made_anew(self)

    def __len__(self) -> int:
        """The number of shapes, of all kinds."""
        return len(self.spheres) + len(self.triangles)

    def __repr__(self) -> str:
        name = f" {self.path.name!r}" if self.path else ""
        tables = ((self.spheres, "sphere"), (self.triangles, "triangle"), (self.lights, "light"))
        return f"<Scene{name}: {', '.join(counted(len(table), word) for table, word in tables if table) or 'empty'}>"

    def _repr_html_(self) -> str:
        return scene_as_html(self)

    @cached_property
    def in_units(self) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
        """`units.in_units`: e, the eye (3,), the spheres' `balls`, the triangles' corners (n, 3, 3)."""
        eye, spheres, triangles = self.camera.eye, self.spheres, self.triangles
        largest = max(spheres.largest, triangles.largest, *map(abs, eye))
        unit, lengths = unit_of(largest, np.array(eye), spheres.balls, triangles.vertices)
        origin, balls, corners = lengths
        for array in (balls, corners):
            array.flags.writeable = False  # to the kernels, arrays that can be written to are others
        return unit, origin, balls, corners

    @cached_property
    def numbered(self) -> tuple[np.ndarray, np.ndarray]:
        """Place in the file and row of `materials`, int32, of all shapes: rows of `spheres.balls`, then triangles."""
        if not len(self.triangles):
            return self.spheres.order, self.spheres.material
        spare = np.zeros(len(self.spheres.balls) - len(self.spheres), np.int32)
        order, material = (
            np.concatenate([ours, spare, theirs])
            for ours, theirs in (
                (self.spheres.order, self.triangles.order), (self.spheres.material, self.triangles.material),
            )
        )  # fmt: skip
        for array in (order, material):
            array.flags.writeable = False
        return order, material

    def shape(self, index: int) -> Shape:
        """The shape at this place among all shapes of the file, counted from 0: what `Hits.index` names.

        IndexError if there is none.
        """
        for table in (self.spheres, self.triangles):
            i = int(np.searchsorted(table.order, index))
            if i < len(table) and table.order[i] == index:
                return table[i]
        raise IndexError(f"shape {index} of a scene of {len(self)}")
