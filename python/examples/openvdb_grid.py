"""Changes a grid of pyopenvdb and renders it: openvdb_grid.py IN.vdb OUT.png [WIDTH HEIGHT SAMPLES]

The grid goes through an array into a volume, and back into a grid that OUT.vdb beside OUT.png stores.
"""

import pathlib
import sys

import cumulet
import numpy
import pyopenvdb


def array_of(grid):
    """The active voxels of a grid as a float32 array indexed [x, y, z], and the index of its first voxel."""
    first, last = grid.evalActiveVoxelBoundingBox()
    values = numpy.zeros([b - a + 1 for a, b in zip(first, last)], numpy.float32)
    grid.copyToArray(values, ijk=first)
    return values, first


def main():
    source, out = sys.argv[1], pathlib.Path(sys.argv[2])
    width, height, samples = (int(text) for text in sys.argv[3:6] or (640, 360, 64))
    grid = pyopenvdb.read(source, "density")
    values, first = array_of(grid)
    values[len(values) // 2:] *= 0.25  # thinner on the right
    volume = cumulet.Volume.from_numpy(values, voxel_size=grid.transform.voxelSize()[0],
                                       origin=grid.transform.indexToWorld(first), name=source)
    picture = cumulet.render(volume, size=(width, height), samples=samples)
    picture.save(out)
    print(picture)
    changed = pyopenvdb.FloatGrid()
    changed.copyFromArray(values, ijk=first)
    changed.transform = grid.transform
    changed.name = "density"
    pyopenvdb.write(str(out.with_suffix(".vdb")), changed)


main()
