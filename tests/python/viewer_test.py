"""Viewers in contexts without a window: pictures, read-back, frames, callbacks of workers, threads."""

import array
import gc
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import zlib

import cumulet

SIZE = (32, 24)


def box(voxels=8):
    values = array.array("f", [1.0] * voxels ** 3)
    return memoryview(values).cast("B").cast("f", (voxels, voxels, voxels))


def viewer_of_box(**arguments):
    viewer = cumulet.Viewer.headless(**arguments)
    viewer.set_sun_sky(sky_radiance=(0.2, 0.3, 0.5), sun_irradiance=(1, 1, 1), sun_elevation_degrees=40)
    viewer.set_medium(density_scale=0.5)
    viewer.set_sampling(samples=4, preview="off")
    viewer.set_volume(cumulet.Volume.from_numpy(box(), name="box"))
    return viewer


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.updates = []
        cls.viewer = viewer_of_box(update=lambda: cls.updates.append(threading.get_ident()))
        cls.picture = cls.viewer.render_picture(SIZE, progress=False)

    @classmethod
    def tearDownClass(cls):
        cls.viewer.close()

    def test_the_chosen_context_and_driver_are_named(self):
        name = self.viewer.context.name()
        self.assertIn(name, ("egl-device", "egl-surfaceless", "egl-default", "osmesa"))
        self.assertTrue(self.picture.driver.startswith(name + ": "))

    def test_the_picture_shows_the_box_before_the_sky(self):
        linear = self.picture.linear
        self.assertEqual(linear.shape, (SIZE[1], SIZE[0], 4))
        self.assertLess(linear[0, 0, 3], 0.1)
        self.assertGreater(linear[SIZE[1] // 2, SIZE[0] // 2, 3], 0.5)
        self.assertTrue(0 < self.picture.noise < 1)

    def test_png(self):
        data = self.picture._repr_png_()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        width, height = struct.unpack(">II", data[16:24])
        self.assertEqual((width, height), SIZE)
        start = data.index(b"IDAT") + 4
        length = struct.unpack(">I", data[start - 8:start - 4])[0]
        rows = zlib.decompress(data[start:start + length])
        self.assertEqual(rows[1:5], bytes(self.picture.display.cast("B")[:4]))
        self.assertEqual(len(rows), SIZE[1] * (1 + 4 * SIZE[0]))

    def test_exr_is_read_by_the_library(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "picture.exr"
            self.picture.save(path)
            info = cumulet.Environment.from_file(path).get_info()
            self.assertEqual((info.width, info.height), SIZE)
            with self.assertRaisesRegex(ValueError, r"picture.gif: pictures are saved as .png or .exr$"):
                self.picture.save(path.with_suffix(".gif"))

    def test_a_display_lut(self):
        shown = bytes(self.picture.display)
        half = memoryview(array.array("f", [0.5] * 24)).cast("B").cast("f", (2, 2, 2, 3))
        self.viewer.set_display_lut(half, shaper="log2", domain=(-8, 8))
        self.assertEqual(bytes(self.viewer.encode_display(self.picture.linear))[:3], b"\x80\x80\x80")
        with self.assertRaisesRegex(ValueError, "its shape is"):
            self.viewer.set_display_lut(box())
        self.viewer.set_display_lut(None)
        self.assertEqual(bytes(self.viewer.encode_display(self.picture.linear)), shown)

    def test_readback(self):
        beauty = self.viewer.read_aov("beauty")
        depth = self.viewer.read_aov("volume_depth")
        self.assertEqual((beauty.shape, depth.shape), ((SIZE[1], SIZE[0], 4), (SIZE[1], SIZE[0], 1)))
        self.assertEqual(self.viewer.encode_display(self.viewer.read_linear()), self.viewer.read_display())
        mattes = self.viewer.read_cryptomatte(lambda kind, tag, index: kind.name.lower(), ranks=1)
        bits = struct.unpack("I", struct.pack("f", mattes[SIZE[1] // 2, SIZE[0] // 2, 0]))[0]
        self.assertEqual(bits, cumulet.cryptomatte_id("volume"))
        with self.assertRaisesRegex(cumulet.Error, "light"):
            self.viewer.read_light_group(0)
        read = self.viewer.begin_read(source="linear")
        values = None
        while values is None:
            values = self.viewer.finish_read(read)
        self.assertEqual(values, self.viewer.read_linear())
        with self.assertRaisesRegex(cumulet.Error, f"there is no read {read}"):
            self.viewer.finish_read(read)
        self.viewer.cancel_read(self.viewer.begin_read(source="aov", aov="error"))
        samples = self.viewer.read_accumulation()
        self.viewer.restore_accumulation(samples)
        with self.assertRaises(cumulet.Error):
            self.viewer.restore_accumulation(samples[:-1])

    def test_pick_bounds_and_statistics(self):
        pick = self.viewer.pick_at(SIZE[0] / 2, SIZE[1] / 2)
        self.assertIs(pick.hit_volume, True)
        self.assertEqual(self.viewer.get_bounds()[1], (7.5, 7.5, 7.5))
        self.assertGreater(self.viewer.get_stats().cells, 0)
        self.assertEqual(self.viewer.get_interpolation(), cumulet.Interpolation.LINEAR, "the default")

    def test_the_same_picture_again(self):
        again = self.viewer.render_picture(SIZE, progress=False)
        self.assertEqual(again.display, self.picture.display)

    def test_a_viewer_can_change_its_thread(self):
        self.viewer.context.release_current()
        failures = []

        def work():
            try:
                self.viewer.read_display()
                self.viewer.context.release_current()
            except cumulet.Error as error:
                failures.append(error)

        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
        self.assertEqual(failures, [])
        self.viewer.read_display()

    def test_settings_do_not_wait_for_frames(self):
        viewer = viewer_of_box(trace=lambda name, begin, end: during(name))
        done = threading.Event()
        frames = []

        def set_medium():
            viewer.set_medium(density_scale=2.0)
            viewer.get_volume()
            done.set()

        def during(name):
            if name == "cumulet: trace" and not frames:
                thread = threading.Thread(target=set_medium)
                thread.start()
                frames.append(done.wait(30.0))  # inside the frame

        viewer.render(width=8, height=8, budget_ms=1, target="none")
        self.assertEqual(frames, [True])
        viewer.close()

    def test_a_frame_costs_little_more_than_in_c(self):
        import frame_cost
        self.assertLess(frame_cost.microseconds(pairs=15), 50.0)

    def test_updates_were_announced(self):
        self.assertTrue(self.updates)

    def test_an_environment_and_a_light(self):
        self.viewer.set_lights([{"kind": "point", "position": (0, 20, 0), "power": 1000, "color": (1, 1, 1)}])
        self.viewer.set_ramp("density", [(0, 0), (1, 0.5)])
        with self.assertRaises(ValueError):
            self.viewer.set_ramp("density", [(0, 0, 0)])
        self.viewer.set_color_ramp("density", [(0, 0, 0, 0), (1, 1, 0.5, 0)])
        with self.assertRaises(ValueError):
            self.viewer.set_color_ramp("density", [(0, 0, 0), (1, 1, 1)])
        for stops in (None, 3, [0, 0, 0, 0]):
            with self.assertRaisesRegex(TypeError, "^stops: groups of 4 numbers are needed, not "):
                self.viewer.set_color_ramp("density", stops)
        with self.assertRaises(cumulet.Error):
            self.viewer.set_color_ramp("density", [(0, 0, 0, 0), (1, 2, 0, 0)])
        brighter = self.viewer.render_picture(SIZE, progress=False)
        self.viewer.set_lights([])
        self.viewer.set_ramp("density", [])
        self.viewer.set_color_ramp("density", [])
        self.viewer.set_clip(box=True, box_min=(0, 0, 0), box_max=(1, 2, 3), planes=[0, 1, 0, -0.5])
        self.viewer.set_clip(planes=[(0, 1, 0, -0.5), (1, 0, 0, 2)])
        with self.assertRaises(TypeError):
            self.viewer.set_clip(planes=[("x", 1, 0, -0.5)])
        with self.assertRaisesRegex(cumulet.Error, "box is empty"):  # a box alone is not ignored
            self.viewer.set_clip(box_min=(0, 0, 0), box_max=(0, 1, 1))
        self.viewer.set_clip(box=False, box_min=(0, 0, 0), box_max=(0, 1, 1))
        with self.assertRaises(cumulet.Error):
            self.viewer.set_clip(planes=[0, 0, 0, 1])
        with self.assertRaisesRegex(cumulet.Error, "plane 0 has no direction"):
            cumulet.Instance().set_clip(planes=[0, 0, 0, 1])
        with self.assertRaises(ValueError):
            self.viewer.set_clip(planes=[0, 1, 0])
        self.viewer.set_clip()
        self.assertNotEqual(brighter.display, self.picture.display)


class Contexts(unittest.TestCase):
    def test_handles_end_in_any_order(self):
        viewer = viewer_of_box()
        viewer.render(width=8, height=8, budget_ms=1, target="none")
        viewer.context.close()
        with self.assertRaisesRegex(cumulet.Error, "^Headless: it is closed$"):
            viewer.render(width=8, height=8)
        viewer.close()

    def test_a_viewer_ends_on_another_thread(self):
        viewers = [viewer_of_box()]
        viewers[0].render(width=8, height=8, budget_ms=1, target="none")
        thread = threading.Thread(target=viewers.clear)
        thread.start()
        thread.join()
        gc.collect()

    def test_an_unknown_backend_is_refused(self):
        with self.assertRaisesRegex(ValueError, "^backend: 'glx' is none of auto, egl, osmesa$"):
            cumulet.Viewer.headless("glx")

    def test_a_nested_context_gives_the_previous_one_back(self):
        outer = viewer_of_box()
        outer.render(width=8, height=8, budget_ms=1, target="none")
        if outer.context.name() == "osmesa":
            self.skipTest("only EGL restores contexts")
        inner = cumulet.Viewer.headless()
        inner.close()
        # Without make_current: the low-level call finds the outer context current.
        frame = cumulet.api.cumulet_frame_desc(width=8, height=8, budget_ms=1, target=cumulet.FrameTarget.NONE)
        self.assertEqual(cumulet.api.cumulet_render(outer._pointer, frame, None), 0)
        outer.close()

    def test_a_process_exits_with_open_viewers(self):
        code = """
import viewer_test
viewers = [viewer_test.viewer_of_box(update=lambda: None)]
viewers[0].render(width=8, height=8, budget_ms=1, target="none")
viewers.append(viewers)
raise SystemExit(5)
"""
        folder = str(pathlib.Path(__file__).resolve().parent)
        result = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, timeout=300,
                                env={**os.environ, "PYTHONPATH": folder + os.pathsep + os.environ["PYTHONPATH"]})
        self.assertEqual((result.returncode, result.stderr), (5, ""))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
