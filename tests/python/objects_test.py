"""Arrays, errors, callbacks and the life of handles, without OpenGL. It needs no NumPy; with NumPy it tests arrays too."""

import array
import gc
import io
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import unittest
import weakref

import cumulet
from cumulet import api

try:
    import numpy
except ImportError:
    numpy = None


def box(*shape, value=1.0):
    """A float32 array with the buffer protocol."""
    count = shape[0] * shape[1] * shape[2]
    return memoryview(array.array("f", [value] * count)).cast("B").cast("f", shape)


class Arrays(unittest.TestCase):
    def line_of(self, kind, function, *arguments, **keywords):
        """The message of an exception, which is one line."""
        with self.assertRaises(kind) as raised:
            function(*arguments, **keywords)
        line = str(raised.exception)
        self.assertNotIn("\n", line)
        return line

    def test_axes_are_x_y_z(self):
        volume = cumulet.Volume.from_numpy(box(2, 3, 4), voxel_size=0.5, origin=(1, 2, 3), name="box")
        info = volume.get_info()
        self.assertEqual((info.name, info.active_voxels), ("box", 24))
        self.assertEqual(info.bounds_min, (0.75, 1.75, 2.75))
        self.assertEqual(info.bounds_max, (1.75, 3.25, 4.75))
        swapped = cumulet.Volume.from_numpy(box(2, 3, 4), axes="zyx").get_info()
        self.assertEqual(swapped.bounds_max, (3.5, 2.5, 1.5))

    def test_matrices_are_columns_or_rows(self):
        rows = [[2, 0, 0, 5], [0, 2, 0, 6], [0, 0, 2, 7], [0, 0, 0, 1]]
        columns = [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1]
        bounds = [cumulet.Volume.from_numpy(box(2, 2, 2), index_to_world=m).get_info().bounds_min
                  for m in (rows, columns)]
        self.assertEqual(bounds, [(4, 5, 6), (4, 5, 6)])

    def test_unsuitable_arrays_are_refused_in_one_line(self):
        doubles = memoryview(array.array("d", [1.0] * 8)).cast("B").cast("d", (2, 2, 2))
        self.assertEqual(self.line_of(TypeError, cumulet.Volume.from_numpy, doubles),
                         "density: its values are float64, not float32; "
                         "numpy.ascontiguousarray(density, numpy.float32) converts it")
        self.assertIn("not list", self.line_of(TypeError, cumulet.Volume.from_numpy, [1.0]))
        flat = memoryview(array.array("f", [1.0] * 8))
        self.assertIn("its shape is (8,), not (n, n, n)", self.line_of(ValueError, cumulet.Volume.from_numpy, flat))
        self.assertIn("strides (8,)", self.line_of(ValueError, cumulet.Volume.from_numpy, flat[::2]))
        self.assertIn("temperature: its values", self.line_of(TypeError, cumulet.Volume.from_fields,
                                                              density=box(2, 2, 2), temperature=doubles))
        self.assertIn("no channel 'heat'", self.line_of(TypeError, cumulet.Volume.from_fields, heat=box(2, 2, 2)))

    def test_unsuitable_arguments_are_refused_in_one_line(self):
        camera = cumulet.Camera(eye=(0, 0, 5))
        self.assertIn("3 numbers are needed, not 2", self.line_of(ValueError, camera.set, eye=(1, 2)))
        self.assertIn("a number is needed", self.line_of(TypeError, camera.set, fovy_degrees="wide"))
        self.assertIn("yaw: ", self.line_of(TypeError, camera.orbit, "x", 0))
        self.assertIn("none of standard, reversed", self.line_of(ValueError, camera.set, depth="odd"))
        viewer = cumulet.Viewer()
        self.assertIn("out of range", self.line_of(ValueError, viewer.set_sampling, samples=-1))
        self.assertIn("a Volume is needed, not Camera", self.line_of(TypeError, viewer.set_volume, camera))
        self.assertIn("no field 'density'",
                      self.line_of(TypeError, cumulet.Instance, volume=None, medium={"density": 2}))
        self.assertIn("density_scale", self.line_of(cumulet.Error, viewer.set_medium, density_scale=-1))

    def test_errors_have_the_line_and_the_status(self):
        with self.assertRaises(cumulet.Error) as raised:
            cumulet.Volume.from_file("missing.vdb")
        self.assertEqual(str(raised.exception), "missing.vdb: no such file")
        self.assertIs(raised.exception.status, cumulet.Status.ERROR_FILE)

    def test_meshes_have_as_many_normals_as_positions(self):
        positions, one = array.array("f", range(9)), array.array("f", [0, 0, 1])
        surfaces = cumulet.Surfaces.from_triangles(meshes=[{"positions": positions, "base_color": (1, 0, 0, 1)}])
        self.assertEqual(surfaces.get_info().triangles, 1)
        self.assertIn("3 for each of 3", self.line_of(ValueError, cumulet.Surfaces.from_triangles,
                                                      meshes=[{"positions": positions, "normals": one}]))

    def test_volumes_and_environments_come_from_bytes_and_file_objects(self):
        header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"
        content = header + bytes([128, 64, 32, 129]) * 2
        for sky in (cumulet.Environment.from_bytes(content, "pak:sky"),
                    cumulet.Environment.from_stream(io.BytesIO(content), "pak:sky")):
            info = sky.get_info()
            self.assertEqual((info.name, info.width, info.height), ("pak:sky", 2, 1))
        no_volume = "pak:cloud: is not a VDB, NanoVDB, NRRD, VTK or TIFF file"
        for line, function, *arguments in (
                (no_volume, cumulet.Volume.from_bytes, content, "pak:cloud"),
                (no_volume, cumulet.Volume.from_stream, io.BytesIO(content), "pak:cloud"),
                ("stream: is empty", cumulet.Volume.from_stream, io.BytesIO()),
                ("memory: truncated Radiance file", cumulet.Environment.from_bytes, header[:20])):
            self.assertEqual(self.line_of(cumulet.Error, function, *arguments), line)
        self.assertIn("no field 'grid'", self.line_of(TypeError, cumulet.Volume.from_stream, io.BytesIO(), grid="a"))

        class Broken(io.BytesIO):
            def read(self, size=-1):
                raise OSError("the archive is gone")

        self.assertEqual(self.line_of(OSError, cumulet.Volume.from_stream, Broken(content)), "the archive is gone")

    def test_other_arrays(self):
        pixels = memoryview(array.array("f", [0.5] * 24)).cast("B").cast("f", (2, 4, 3))
        environment = cumulet.Environment.from_pixels(pixels)
        self.assertEqual(environment.get_info().mean_radiance, (0.5, 0.5, 0.5))
        self.assertEqual(environment.get_pixels(4, 2).shape, (2, 4, 3))
        sparse = cumulet.Volume.from_sparse(
            brick_origins=array.array("i", [0, 0, 0, 8, 0, 0]), brick_values=array.array("f", [1.0] * 1024),
            tiles=[{"min": (0, 8, 0), "max": (7, 15, 7), "value": 1, "active": 1}])
        self.assertEqual(sparse.get_info().active_voxels, 3 * 512)
        self.assertEqual(cumulet.region_pixels((0.5, 0, 0.5, 0), 10, 10), (5, 0, 5, 10))
        self.assertEqual(cumulet.cryptomatte_id("hello"), 0x248BFA47)

    def test_a_sequence_reports_its_frames(self):
        sequence = cumulet.Sequence(["missing.1.vdb", "missing.2.vdb"], file={"suggested_density_scale": True})
        sequence.set_playback(frames_per_second=2, repeat="loop")
        self.assertEqual(sequence.get_frame_at(0.5), 1)
        with cumulet.Viewer() as viewer:
            viewer.set_sequence(sequence)
            with self.assertRaises(cumulet.Error):
                viewer.wait(-1)
            info, states = viewer.get_sequence_info()
            self.assertEqual((info.frames, len(states)), (2, 2))
            self.assertIn(cumulet.FrameState.FAILED, states)
            failed = states.index(cumulet.FrameState.FAILED)
            self.assertEqual(viewer.get_sequence_frame(failed), f"missing.{failed + 1}.vdb: no such file")
            instance = cumulet.Instance(sequence=sequence)
            viewer.add_instance(instance)
            self.assertEqual(viewer.get_sequence_info(instance)[0].frames, 2)
            self.assertIsInstance(viewer.get_sequence_frame(0, instance), str)

    def test_arrays_that_are_read_in_place_live_until_the_library_releases_them(self):
        class Owned(bytearray):
            pass

        owner = Owned(4 * 512)
        released = threading.Event()
        weakref.finalize(owner, released.set)
        volume = cumulet.DynamicVolume(bounds_max=(8, 8, 8))
        volume.set(memoryview(owner).cast("f", (8, 8, 8)), copy=False)
        del owner
        gc.collect()
        self.assertFalse(released.is_set())
        volume.close()
        gc.collect()
        self.assertTrue(released.is_set())

    @unittest.skipUnless(numpy, "NumPy is not installed")
    def test_numpy_arrays_are_not_copied(self):
        values = numpy.ones((4, 5, 6), numpy.float32)
        self.assertEqual(cumulet._support.Array(values, "values").address, values.ctypes.data)
        values.setflags(write=False)
        self.assertEqual(cumulet._support.Array(values, "values").address, values.ctypes.data)
        self.assertIn("not float32", self.line_of(TypeError, cumulet.Volume.from_numpy, values.astype(">f4")))
        self.assertIn("not C-contiguous", self.line_of(ValueError, cumulet.Volume.from_numpy, values.T))
        self.assertEqual(cumulet.Camera(eye=numpy.ones(3)).get().eye, (1, 1, 1))
        cumulet.Instance(volume=cumulet.Volume.from_numpy(values), to_world=numpy.eye(4))


class Handles(unittest.TestCase):
    def test_closed_handles_are_refused(self):
        volume = cumulet.Volume.from_numpy(box(2, 2, 2))
        volume.close()
        volume.close()
        self.assertTrue(volume.closed)
        with self.assertRaisesRegex(cumulet.Error, "^Volume: it is closed$"):
            volume.get_info()
        with cumulet.Viewer() as viewer:
            with self.assertRaisesRegex(cumulet.Error, "^Volume: it is closed$"):
                viewer.set_volume(volume)
        with self.assertRaisesRegex(cumulet.Error, "^Viewer: it is closed$"):
            viewer.get_progress()

    def test_viewers_keep_what_they_show(self):
        viewer = cumulet.Viewer()
        volume = cumulet.Volume.from_numpy(box(4, 4, 4), name="kept")
        viewer.set_volume(volume)
        volume.close()
        viewer.wait(-1)
        shown = viewer.get_volume()
        viewer.close()
        self.assertEqual(shown.get_info().name, "kept")

    def test_an_object_ends_with_its_last_reference_even_in_a_cycle(self):
        class Host:
            def __init__(self):
                self.viewer = cumulet.Viewer(update=self.on_update)

            def on_update(self):
                pass

        host = Host()
        gone = weakref.ref(host.viewer)
        del host
        gc.collect()
        self.assertIsNone(gone())

    def test_callbacks_of_workers_run_python_and_may_not_call_the_library(self):
        lines, threads, refusals = [], set(), []

        def trace(name, begin, end):
            lines.append(name)
            threads.add(threading.get_ident())
            viewers[0].get_progress()
            try:
                viewers[0].get_stats()
            except cumulet.Error as error:
                refusals.append(str(error))

        viewers = [cumulet.Viewer(trace=trace)]
        with tempfile.TemporaryDirectory() as folder, viewers[0] as viewer:
            bad = pathlib.Path(folder) / "bad.vdb"
            bad.write_bytes(b"not a volume")
            viewer.set_volume(cumulet.Volume.from_numpy(box(16, 16, 16)))
            viewer.wait(-1)
            viewer.load_volume(bad)
            with self.assertRaisesRegex(cumulet.Error, "bad.vdb: "):
                viewer.wait(-1)
        self.assertTrue(lines and all(isinstance(line, str) for line in lines))
        self.assertGreater(len(threads - {threading.get_ident()}), 0, "no callback came from a worker")
        self.assertEqual(set(refusals), {"cumulet_get_stats: a callback must not call the library"})

    def test_a_viewer_that_ends_in_a_callback_is_destroyed_later(self):
        victims = [cumulet.Viewer()]
        receive = cumulet._support.callback(api.cumulet_update_fn, lambda: victims.clear())
        receive(None)
        self.assertEqual(len(cumulet._support._postponed), 1)
        cumulet.Viewer().close()
        self.assertEqual(len(cumulet._support._postponed), 0)

    def test_an_object_may_be_closed_while_another_thread_uses_it(self):
        for _ in range(20):
            volume = cumulet.DynamicVolume()
            started = threading.Event()

            def work():
                with self.assertRaisesRegex(cumulet.Error, "it is closed"):
                    while True:
                        volume.set(box(8, 8, 8))
                        started.set()

            thread = threading.Thread(target=work)
            thread.start()
            started.wait()
            volume.close()
            thread.join()

    def test_threads_may_share_a_viewer(self):
        viewer = cumulet.Viewer()
        volume = cumulet.Volume.from_numpy(box(8, 8, 8))
        failures = []

        def work():
            try:
                for _ in range(50):
                    viewer.set_volume(volume)
                    viewer.get_progress()
                    viewer.cancel()
            except cumulet.Error as error:
                failures.append(error)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        viewer.close()
        self.assertEqual(failures, [])


def run(code, **environment):
    """Runs Python code in a process of its own."""
    variables = {**os.environ, **environment}
    return subprocess.run([sys.executable, "-B", "-c", code], env=variables, capture_output=True, text=True, timeout=120)


class Processes(unittest.TestCase):
    def test_the_interpreter_exits_while_viewers_work(self):
        code = """
import array, sys, threading, cumulet
values = memoryview(array.array("f", [1.0] * 64 ** 3)).cast("B").cast("f", (64, 64, 64))
volume = cumulet.Volume.from_numpy(values)
dynamic = cumulet.DynamicVolume()
viewers = [cumulet.Viewer(log=print, update=lambda: None) for _ in range(3)]
for viewer in viewers:
    viewer.set_dynamic_volume(dynamic)
dynamic.set(values, copy=False)
viewers[0].set_volume(volume)
def wait():
    try:
        viewers[1].wait(-1)
    except cumulet.Error:
        pass  # cancelled by the exit
threading.Thread(target=wait, daemon=True).start()
viewers.append(viewers)  # a cycle
sys.exit(3)
"""
        for _ in range(5):
            result = run(code)
            self.assertEqual((result.returncode, result.stderr), (3, ""), result)

    def test_a_missing_library_is_one_line(self):
        with tempfile.TemporaryDirectory() as folder:
            package = pathlib.Path(cumulet.__file__).parent
            os.makedirs(f"{folder}/cumulet")
            for file in package.glob("*.py"):
                (pathlib.Path(folder) / "cumulet" / file.name).write_bytes(file.read_bytes())
            result = run("import cumulet", PYTHONPATH=folder, CUMULET_LIBRARY_DIR="", LD_LIBRARY_PATH="")
            if result.returncode == 0:
                self.skipTest("libcumulet is installed on this system")
            self.assertEqual(result.stderr.strip().split("\n")[-1],
                             "ImportError: cumulet: libcumulet.so.0: cannot open shared object file: No such file or "
                             "directory; CUMULET_LIBRARY_DIR names the folder of the library")

    def test_an_old_python_is_one_line(self):
        result = run("import sys; sys.version_info = (3, 7, 16); import cumulet")
        self.assertEqual(result.stderr.strip().split("\n")[-1],
                         "ImportError: cumulet needs Python 3.8 or later; this is 3.7.16")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
