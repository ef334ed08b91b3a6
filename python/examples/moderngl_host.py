"""Renders into a framebuffer of moderngl: moderngl_host.py VOLUME OUT.png [WIDTH HEIGHT SAMPLES]"""

import sys

import cumulet
import moderngl


def main():
    volume, out = sys.argv[1:3]
    width, height, samples = (int(text) for text in sys.argv[3:6] or (640, 360, 32))
    context = moderngl.create_standalone_context(require=450, backend="egl")
    target = context.framebuffer(context.texture((width, height), 4))
    target.clear(0, 0, 0, 1)
    # moderngl's functions are those of the current context, which cumulet.get_proc finds.
    with cumulet.Viewer(get_proc=cumulet.get_proc) as viewer:
        viewer.set_sun_sky(**cumulet.DAY)
        viewer.set_sampling(samples=samples)
        viewer.load_volume_file(volume, suggested_density_scale=True)
        viewer.wait_until_loaded()
        flags = cumulet.RenderFlags(0)
        while not flags & cumulet.RenderFlags.CONVERGED:
            flags = viewer.render(framebuffer=target.glo, width=width, height=height, flip_y=True, budget_ms=200).flags
        shown = memoryview(target.read(components=4)).cast("B", shape=(height, width, 4))
        picture = cumulet.Picture(viewer.read_linear(), shown, viewer.get_stats().gl_renderer)
    picture.save(out)
    print(picture)


main()
