"""A stage of one's own: how hits become colours, in numpy.

python -m sketch --plug my_stage.py
"""

import numpy as np

STAGE = "diffuse"  # the stage that it stands in for, and is compared with


def stage(block):
    """Colours of a block of pixels, 0 to 1: an array of the shape of block.hits.index, and three colours.

    block.hit is True where anything is hit: an array, one a pixel. These have a row for each of those pixels:
    block.points, block.normals (of length 1), block.diffuse (its colour), block.cosine(light), which is max(0, N*L),
    block.to_light(light), unit vectors. block.hits.t and block.hits.index say how far and which shape, for all pixels.
    block.lights are the lights, block.scene is the scene. block.paint(colours, elsewhere=...) puts the colours of the
    hits back where they belong.
    """
    total = np.zeros_like(block.diffuse)
    for light in block.lights:
        total += block.cosine(light)[:, None] * light.colour
    return block.paint(total * block.diffuse, elsewhere=block.scene.background)
