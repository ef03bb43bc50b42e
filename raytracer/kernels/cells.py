"""Which shapes the cells of a screen may show: eight spheres at a time, and triangles one after the other.

    balls     x y z r | x y z r | …      float64, flat, in the scene's place
    corners   three times x y z each     float64 (n, 3, 3), likewise
      ↓ seen from an origin, in a plane mirror or without
    boxes     left right top bottom | …  int32 (n, 4), in pixels, of rows of balls and then of triangles
      ↓ sort_into_cells
    starts    where the list of each cell begins
    entries   shape, box | shape, box …  int32, flat

A cell is at most 128 pixels wide and high. The box of an entry is what of the shape's box lies in the cell, a byte for
each side: left, 127 − right, top, 127 − bottom, ends included. For a place (x, y) in the cell take the bytes 128 + x,
255 − x, 128 + y, 255 − y: it is in the box if no byte's highest bit is lost when the box is taken away (`in_box`).
"""

import numpy as np

from raytracer.arrays import CELL_BITS
from raytracer.boxes import beside, box_of, facet_box
from raytracer.certified import inner, side_of
from raytracer.kernels.compiler import borrowing, called, compiled, inlined
from raytracer.kernels.lanes import WIDTH, load_rows, spread, store_boxes
from raytracer.twofold import select

_MARGIN = 2.0**-40  # see `raytracer.mirrors`
_COVERED = 2.0**-31  # of a corner's distance: the box of a triangle is that much too large anyway
_ABOUT = 1.0 + 1e-9  # times the radius of a sphere about a triangle
_LAST = (1 << CELL_BITS) - 1
_CORNER = 0xFF80FF80 - 2**32  # the spot of (0, 0): the bytes 128, 255, 128, 255


@borrowing
def bound_images(lens, eye, plane, balls, corners, boxes):
    """Boxes, flat, of the images of all shapes in the mirror of a plane, given by n and n·X; of all 0 for no mirror.

    The plane's fifth number is of any lengths beside those of the shapes that rays are rounded in. Of what is hard to
    tell, the whole picture.
    """
    distance = plane[3] - inner(plane[0], plane[1], plane[2], eye[0], eye[1], eye[2])
    reach = abs(eye[0]) + abs(eye[1]) + abs(eye[2]) + abs(plane[3]) + plane[4]
    spheres = np.uint64(len(balls) // 4)
    for i in range(np.uint64(0), spheres, np.uint64(WIDTH)):
        x, y, z, radius = load_rows(balls, i)
        (qx, qy, qz), size = _image(eye, plane, distance, x, y, z)
        radius = radius + _MARGIN * (size + reach + radius)
        box, (c, square) = box_of(lens, qx, qy, qz, radius), side_of(qx, qy, qz, radius)
        hidden = select(box.known, box.ahead <= 0.0, beside(lens, qx, qy, qz, c, square, radius))
        hidden = hidden | ~(radius == radius)  # a row to spare is not a number
        left, right = select(box.known, box.left, 0.0), select(box.known, box.right, lens.width)
        top, bottom = select(box.known, box.top, 0.0), select(box.known, box.bottom, lens.rows)
        store_boxes(boxes, i, left, select(hidden, 0.0, right), top, bottom)
    for i in range(np.uint64(len(corners))):
        box, at = _box_of_triangle(lens, eye, plane, distance, reach, corners, i), np.uint64(4) * (spheres + i)
        for side in range(4):
            boxes[at + np.uint64(side)] = np.int32(box[side])


@inlined
def _image(eye, plane, distance, x, y, z):
    """A point's mirror image as seen from the eye; and the sum of all lengths that come together in it."""
    qx, qy, qz = x - eye[0], y - eye[1], z - eye[2]
    twice = 2.0 * (inner(plane[0], plane[1], plane[2], qx, qy, qz) - distance)
    image = qx - twice * plane[0], qy - twice * plane[1], qz - twice * plane[2]
    return image, abs(x) + abs(y) + abs(z) + abs(image[0]) + abs(image[1]) + abs(image[2])


@inlined
def _box_of_triangle(lens, eye, plane, distance, reach, corners, i):
    """What both the corners of an image and a sphere about it allow."""
    a, sure_a, size_a = _corner(eye, plane, distance, reach, corners, i, 0)
    b, sure_b, size_b = _corner(eye, plane, distance, reach, corners, i, 1)
    c, sure_c, size_c = _corner(eye, plane, distance, reach, corners, i, 2)
    left, right, top, bottom = 0.0, lens.width, 0.0, lens.rows
    if sure_a and sure_b and sure_c:
        left, right, top, bottom = facet_box(lens, a, b, c)
    x, y, z = (a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0, (a[2] + b[2] + c[2]) / 3.0
    square = max(_square(a, x, y, z), _square(b, x, y, z), _square(c, x, y, z))
    radius = np.sqrt(square) * _ABOUT + _MARGIN * (size_a + size_b + size_c)
    about, (c, square) = box_of(lens, x, y, z, radius), side_of(x, y, z, radius)
    if about.ahead <= 0.0 if about.known else beside(lens, x, y, z, c, square, radius):
        return 0.0, 0.0, 0.0, 0.0
    if not about.known:
        return left, right, top, bottom
    return max(left, about.left), min(right, about.right), max(top, about.top), min(bottom, about.bottom)


@inlined
def _corner(eye, plane, distance, reach, corners, i, corner):
    """The image of a triangle's corner; whether its box allows for the margin; and the lengths that it is made of."""
    image, size = _image(eye, plane, distance, corners[i, corner, 0], corners[i, corner, 1], corners[i, corner, 2])
    away = abs(image[0]) + abs(image[1]) + abs(image[2])
    return image, _MARGIN * (size + reach) <= _COVERED * away, size + reach


@inlined
def _square(a, x, y, z):
    return (a[0] - x) * (a[0] - x) + (a[1] - y) * (a[1] - y) + (a[2] - z) * (a[2] - z)


@inlined
def spot_of(x, y):
    """What `in_box` wants to know of eight places in a cell."""
    return x * spread(np.int32(1 - 256)) + y * spread(np.int32(65536 - 16777216)) + spread(np.int32(_CORNER))


@compiled
def sort_into_cells(boxes, columns, rows, shift, wider, most):
    """The lists of the cells, 2**shift pixels wide and high, of some screens: boxes are int32 (screens, shapes, 4).

    `wider` is how many pixels a box begins too late. Returns starts, int64 (cells + 1,), and entries; both empty if
    there were more entries than `most`.
    """
    starts = np.zeros(boxes.shape[0] * rows * columns + 1, np.int64)
    _count_entries(boxes, columns, rows, shift, wider, starts)
    for cell in range(1, len(starts)):
        starts[cell] += starts[cell - 1]
    if starts[-1] > most:
        return np.empty(0, np.int64), np.empty(0, np.int32)
    entries = np.empty(2 * starts[-1], np.int32)
    _put_entries(boxes, columns, rows, shift, wider, starts.copy(), entries)
    return starts, entries


@called
def _count_entries(boxes, columns, rows, shift, wider, starts):
    """How many entries each cell has, into the element after its own."""
    for screen in range(boxes.shape[0]):
        for i in range(boxes.shape[1]):
            left, right, top, bottom = _reaching(boxes, screen, i, wider)
            for row in range(top >> shift, (bottom >> shift) + 1):
                for column in range(left >> shift, (right >> shift) + 1):
                    starts[(screen * rows + row) * columns + column + 1] += 1


@called
def _put_entries(boxes, columns, rows, shift, wider, places, entries):
    """Each entry into the list of its cell; `places` is where each list goes on."""
    for screen in range(boxes.shape[0]):
        for i in range(boxes.shape[1]):
            left, right, top, bottom = _reaching(boxes, screen, i, wider)
            for row in range(top >> shift, (bottom >> shift) + 1):
                for column in range(left >> shift, (right >> shift) + 1):
                    cell, x, y = (screen * rows + row) * columns + column, column << shift, row << shift
                    first, last = max(left - x, 0), min(right - x, _LAST)
                    high, low = max(top - y, 0), min(bottom - y, _LAST)
                    entries[2 * places[cell]] = i
                    entries[2 * places[cell] + 1] = first | (_LAST - last) << 8 | high << 16 | (_LAST - low) << 24
                    places[cell] += 1


@inlined
def _reaching(boxes, screen, i, wider):
    """The first and last column, and row, of pixels of a box; of an empty one, none."""
    left, right = max(boxes[screen, i, 0] - wider, 0), boxes[screen, i, 1] - 1
    top, bottom = max(boxes[screen, i, 2] - wider, 0), boxes[screen, i, 3] - 1
    return (left, right, top, bottom) if left <= right and top <= bottom else (0, -1, 0, -1)
