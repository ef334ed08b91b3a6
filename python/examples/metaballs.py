"""Renders metaballs that NumPy computes: metaballs.py OUT.png [WIDTH HEIGHT SAMPLES]"""

import sys

import cumulet
import numpy


def density(voxels=64):
    """A float32 array indexed [x, y, z], over the cube from -1 to 1."""
    x, y, z = numpy.meshgrid(*[numpy.linspace(-1, 1, voxels, dtype=numpy.float32)] * 3, indexing="ij")
    balls = ((-0.4, -0.1, 0.1, 0.3), (0.35, 0.1, -0.1, 0.35), (0.0, 0.45, 0.2, 0.2))
    field = sum(r * r / ((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2 + 1e-6) for a, b, c, r in balls)
    return numpy.ascontiguousarray(numpy.clip(field - 1, 0, 1), dtype=numpy.float32)


def main():
    out = sys.argv[1]
    width, height, samples = (int(text) for text in sys.argv[2:5] or (640, 360, 64))
    values = density()
    volume = cumulet.Volume.from_numpy(values, voxel_size=2 / (len(values) - 1), origin=(-1, -1, -1), name="metaballs")
    medium = {"density_scale": 60, "coalbedo": (0.02, 0.1, 0.3)}
    picture = cumulet.render(volume, size=(width, height), samples=samples, medium=medium)
    picture.save(out)
    print(picture)


main()
