"""Runs the examples of python/examples, as far as their modules are installed.

The environment has CUMULET_SOURCE, the root of the checkout.
"""

import base64
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import cumulet

EXAMPLES = pathlib.Path(os.environ["CUMULET_SOURCE"]) / "python/examples"
SECONDS = 200


def needs(*modules):
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    return unittest.skipIf(missing, f"not installed: {', '.join(missing)}")


def run(*command, **environment):
    return subprocess.run([sys.executable, "-B", *map(str, command)], capture_output=True, text=True, timeout=SECONDS,
                          env={**os.environ, **environment})


class Examples(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_example(self, name, *arguments):
        result = run(EXAMPLES / name, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def check_png(self, path):
        self.assertEqual(path.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(path.stat().st_size, 200)

    @needs("numpy")
    def test_metaballs(self):
        said = self.run_example("metaballs.py", self.folder / "metaballs.png", 48, 32, 2)
        self.assertIn("<cumulet.Picture 48x32", said)
        self.check_png(self.folder / "metaballs.png")

    @needs("numpy")
    def test_simulation(self):
        said = self.run_example("simulation.py", self.folder / "smoke", 3, 32, 24)
        self.assertIn("3 states of 3 were displayed", said)
        pictures = sorted(self.folder.glob("smoke*.png"))
        self.assertEqual(len({path.read_bytes() for path in pictures}), 3)

    @needs("numpy", "pytest")
    def test_screenshots_by_pytest(self):
        tests = EXAMPLES / "screenshots"
        command = ("-m", "pytest", "-q", "-p", "no:cacheprovider", tests, f"--references={self.folder}")
        self.assertEqual(run(*command, "--update-screenshots").returncode, 0)
        self.assertEqual(run(*command).returncode, 0)
        changed = run(*command, BALL_RADIUS="0.6")
        self.assertEqual(changed.returncode, 1)
        self.assertIn("ball: the difference is", changed.stdout)
        self.check_png(self.folder / "ball.failed.png")

    def volume(self):
        """A volume file, which is a NanoVDB or OpenVDB file of the build's sample scene."""
        path = os.environ.get("CUMULET_VOLUME")
        if path is None or not os.path.exists(path):
            self.skipTest("there is no sample volume")
        return path

    @needs("moderngl")
    def test_moderngl_host(self):
        self.run_example("moderngl_host.py", self.volume(), self.folder / "moderngl.png", 48, 32, 2)
        self.check_png(self.folder / "moderngl.png")

    @needs("numpy", "pyopenvdb")
    def test_openvdb_grid(self):
        import numpy
        import pyopenvdb
        path, out = self.volume(), self.folder / "grid.png"
        self.run_example("openvdb_grid.py", path, out, 48, 32, 2)
        self.check_png(out)
        # The written grid has the voxels of the file where the example does not change them.
        old, new = (pyopenvdb.read(str(one), "density") for one in (path, out.with_suffix(".vdb")))
        first, last = old.evalActiveVoxelBoundingBox()
        self.assertEqual(new.evalActiveVoxelBoundingBox(), (first, last))
        values = [numpy.zeros([b - a + 1 for a, b in zip(first, last)], numpy.float32) for _ in range(2)]
        for grid, array in zip((old, new), values):
            grid.copyToArray(array, ijk=first)
        half = len(values[0]) // 2
        self.assertTrue((values[0][:half] == values[1][:half]).all())
        self.assertTrue((values[0][half:] * numpy.float32(0.25) == values[1][half:]).all())
        info = [cumulet.Volume.from_file(one).get_info() for one in (path, out.with_suffix(".vdb"))]
        self.assertEqual((info[0].bounds_min, info[0].bounds_max), (info[1].bounds_min, info[1].bounds_max))

    def test_blender_smoke(self):
        blender = shutil.which("blender")
        if blender is None:
            self.skipTest("not installed: blender")
        out = self.folder / "blender.png"
        command = (blender, "--background", "--factory-startup", "--python-exit-code", "3", "--python",
                   EXAMPLES / "blender_smoke.py", "--", out, 3, 48, 32, 2)
        result = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=SECONDS)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("<cumulet.Picture 48x32", result.stdout)
        self.check_png(out)

    @needs("PyQt6")
    def test_qt_host(self):
        if shutil.which("xvfb-run") is None:
            self.skipTest("not installed: xvfb")
        command = ("xvfb-run", "-a", sys.executable, "-B", EXAMPLES / "qt_host.py", self.volume())
        result = subprocess.run([*map(str, command), str(self.folder / "qt.png"), "2"], capture_output=True, text=True,
                                timeout=SECONDS)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.check_png(self.folder / "qt.png")

    def test_examples_compile(self):
        for path in EXAMPLES.rglob("*.py"):
            compile(path.read_text(encoding="utf-8"), str(path), "exec")


class Notebooks(unittest.TestCase):
    @needs("nbclient", "nbformat", "ipykernel")
    def test_the_notebook_runs(self):
        import nbclient
        import nbformat
        notebook = nbformat.read(EXAMPLES / "notebook.ipynb", 4)
        with tempfile.TemporaryDirectory() as folder:
            resources = {"metadata": {"path": folder}}
            nbclient.NotebookClient(notebook, timeout=SECONDS, resources=resources).execute()
            self.assertEqual(os.listdir(folder), ["evening.exr"])
        outputs = [one for cell in notebook.cells for one in cell.get("outputs", ())]
        pictures = [one["data"]["image/png"] for one in outputs if "image/png" in one.get("data", ())]
        self.assertEqual(len(set(pictures)), 2)
        for picture in pictures:
            self.assertEqual(base64.b64decode(picture)[:8], b"\x89PNG\r\n\x1a\n")
        warnings = [one["text"] for one in outputs if "Warning" in one.get("text", "")]
        self.assertEqual(warnings, [])

    @needs("IPython")
    def test_a_notebook_shows_a_picture(self):
        from IPython.core.formatters import DisplayFormatter
        pixels = memoryview(bytes(16)).cast("B", shape=(2, 2, 4))
        picture = cumulet.Picture(memoryview(bytearray(64)).cast("f", shape=(2, 2, 4)), pixels, "none")
        data, _ = DisplayFormatter().format(picture)
        self.assertEqual(data["image/png"][:8], b"\x89PNG\r\n\x1a\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
