"""Renders a running NumPy simulation: simulation.py OUT_PREFIX [STEPS WIDTH HEIGHT]

The simulation changes its array in place. The viewer shows each state while the next one is computed.
"""

import sys

import cumulet
import numpy


class Smoke:
    """Smoke that rises and spreads in a box of voxels."""

    def __init__(self, voxels=32):
        self.density = numpy.zeros((voxels, voxels, voxels), numpy.float32)
        self.source = slice(voxels * 3 // 8, voxels * 5 // 8)

    def step(self):
        density = self.density
        density[self.source, 2:4, self.source] = 1
        density[:, 1:] = density[:, :-1]  # up, along y
        density[:, 0] = 0
        for axis in (0, 2):
            density[:] = 0.5 * density + 0.25 * (numpy.roll(density, 1, axis) + numpy.roll(density, -1, axis))


def main():
    prefix = sys.argv[1]
    steps, width, height = (int(text) for text in sys.argv[2:5] or (24, 320, 240))
    smoke = Smoke()
    size = 2 / len(smoke.density)
    volume = cumulet.DynamicVolume(bounds_min=(-1, -1, -1), bounds_max=(1, 1, 1))
    with cumulet.Viewer.headless(log=lambda level, line: print(line, file=sys.stderr)) as viewer:
        viewer.set_sun_sky(**cumulet.DAY)
        viewer.set_ground(mode="below", albedo=(0.3, 0.3, 0.3))
        viewer.set_medium(density_scale=20)
        viewer.set_sampling(samples=8, preview="off")
        viewer.set_camera(cumulet.Camera(eye=(1.2, 0.8, 3.2), target=(0, -0.2, 0)))
        viewer.set_dynamic_volume(volume)
        for step in range(steps):
            smoke.step()
            volume.set(smoke.density, voxel_size=size, origin=(-1, -1, -1), name=f"step {step}")
            picture = viewer.render_picture((width, height), progress=False)
            picture.save(f"{prefix}{step:04}.png")
        info = viewer.get_dynamic_volume_info()
    print(f"{info.displayed_count} states of {info.submitted_update} were displayed")


main()
