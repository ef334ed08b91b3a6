"""Screenshot tests of a plug-in that makes volumes."""

import os

import numpy


def ball(voxels=24):
    """The plug-in's result."""
    x, y, z = numpy.meshgrid(*[numpy.linspace(-1, 1, voxels, dtype=numpy.float32)] * 3, indexing="ij")
    radius = float(os.environ.get("BALL_RADIUS", "0.8"))
    return (x * x + y * y + z * z < radius * radius).astype(numpy.float32)


def test_ball(screenshot):
    camera = {"eye": (30, 25, 70), "target": (11.5, 11.5, 11.5)}
    screenshot("ball", ball(), size=(48, 36), samples=16, camera=camera, medium={"density_scale": 0.5})
