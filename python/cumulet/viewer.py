"""The viewer: it renders a scene in an OpenGL context."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import threading
import time
from typing import Any, Callable, Dict, Iterable, List, Mapping, Tuple

from . import _methods, _support, api, objects
from ._support import Array, Error
from .picture import Picture, progress_bar

WAIT_MS = 100.0  # Ctrl+C has an effect after this time
FRAME_MS = 500.0


@functools.lru_cache(maxsize=None)
def _loaders() -> List[Any]:
    """The functions of EGL and GLX that return addresses of GL functions. GLVND serves every current context."""
    found = []
    for library, name in (("libEGL.so.1", "eglGetProcAddress"), ("libGL.so.1", "glXGetProcAddressARB")):
        try:
            loader = getattr(ctypes.CDLL(library), name)
        except (OSError, AttributeError):
            continue
        loader.restype, loader.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
        found.append(loader)
    return found


def get_proc(name: str) -> int:
    """The address of a GL function of the current context, for hosts whose toolkit has no such function. 0: none."""
    return next((address for address in (loader(name.encode()) for loader in _loaders()) if address), 0)


def _address(function: Any) -> Any:
    """get_proc for C. Toolkits return integers or objects that convert to one."""
    return (lambda name: int(function(name) or 0)) if callable(function) else function


class _Calls:
    """Counts the running calls of a viewer."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._running = 0

    def begin(self, viewer: Viewer) -> Any:
        """Returns the viewer's pointer, which stays valid until end()."""
        with self._changed:
            pointer = viewer._pointer
            self._running += 1
            return pointer

    def end(self) -> None:
        with self._changed:
            self._running -= 1
            self._changed.notify_all()

    def wait(self, seconds: float) -> bool:
        """Waits until no call is running. Returns False if the time ran out."""
        with self._changed:
            return self._changed.wait_for(lambda: self._running == 0, seconds)


def _destroy(pointer: Any, calls: _Calls, gl_lock: Any, context: Any, callbacks: Any) -> None:
    """Destroys a viewer after the running calls of other threads, then its context. The callbacks live until then."""
    api.cumulet_cancel(pointer)
    if not gl_lock.acquire(timeout=_support.EXIT_SECONDS):
        return  # a thread still uses it
    try:
        if not calls.wait(_support.EXIT_SECONDS):
            return
        if context is not None and not context.closed:
            try:
                context.make_current()
            except Error:
                pass  # its GL objects end with the context
        api.cumulet_destroy(pointer)
        if context is not None:
            context.close()
    finally:
        gl_lock.release()
    del callbacks


class Viewer(_methods.ViewerMethods):
    """Renders a scene. Without get_proc and context it is detached: it loads files, but cannot render.

    get_proc: Returns the address of a GL function of the host's current context; for example cumulet.get_proc.
    context: A cumulet.Headless, which the viewer then owns; see Viewer.headless.
    log: Receives (level, line). update: is called when there is something to render. trace: receives (name, begin, end).

    Callbacks come from any thread, with the GIL. They must not call the library, except `cancel` and `get_progress`.
    """

    _closed_at_exit = 0

    def __init__(self, *, get_proc: Callable[[str], Any] | None = None, context: Any = None,
                 log: Callable[[int, str], Any] | None = None, update: Callable[[], Any] | None = None,
                 trace: Callable[[str, float, float], Any] | None = None, gl_state: api.GlStatePolicy | str | None = None,
                 shader_cache: objects.ShaderCache | None = None) -> None:
        _support.destroy_postponed()
        self._gl_lock = threading.RLock()  # held during calls that use the context
        self._running = _Calls()
        self._size = (0, 0)  # height and width of the displayed image
        self.context = context
        desc = _support.fill(api.cumulet_create_desc, {
            "get_proc": _address(get_proc), "log": log, "update": update, "trace": trace, "gl_state": gl_state,
            "shader_cache": shader_cache})
        if context is not None:
            if get_proc is not None:
                raise TypeError("a viewer has a get_proc or a context, not both")
            from . import headless_api
            context.make_current()
            function: Any = headless_api.cumulet_headless_get_proc
            desc.get_proc = ctypes.cast(function, api.cumulet_get_proc_fn)
            desc.get_proc_user = ctypes.cast(context._pointer, ctypes.c_void_p)
        self._callbacks: List[Any] = [desc]
        out = ctypes.POINTER(api.cumulet_viewer)()
        _support.call(api.cumulet_create, ctypes.byref(desc), ctypes.byref(out))
        self._adopt(out)

    @classmethod
    def headless(cls, backend: str = "auto", **arguments: Any) -> Viewer:
        """A viewer with an OpenGL context of its own, without a window; by EGL or else OSMesa (`viewer.context.name()`).

        The context is current on this thread until `viewer.context.release_current()` or `close()`.

        backend: "auto", "egl" or "osmesa". arguments: log, update, trace, shader_cache.
        """
        from .headless import Headless
        context = Headless(backend=backend)
        try:
            return cls(context=context, **arguments)
        except BaseException:
            context.close()
            raise

    # Calls. Threads wait for each other only if both use the context.

    def _call(self, function: Any, *arguments: Any) -> Any:
        _support.refuse_in_callback(function)
        pointer = self._running.begin(self)
        try:
            result = _support.checked_types(function, (pointer, *arguments))
            if function.restype is ctypes.c_int and result != 0:
                line = api.cumulet_last_error(pointer).decode("utf-8", "replace")
                raise Error(line or api.cumulet_status_text(result).decode("utf-8"), result)
            return result
        finally:
            self._running.end()

    def _call_gl(self, function: Any, *arguments: Any) -> Any:
        _support.refuse_in_callback(function)
        with self._gl_lock:
            if self.context is not None and self._pointer:  # raises Error if the viewer is closed
                self.context.make_current()
            result = self._call(function, *arguments)
            if function is api.cumulet_render:
                shown = arguments[1]._obj
                self._size = (shown.height, shown.width)
            return result

    def _call_any_time(self, function: Any, *arguments: Any) -> Any:
        pointer = self._running.begin(self)
        try:
            return function(pointer, *arguments)
        finally:
            self._running.end()

    def _release(self, out: Any) -> None:
        destroy = functools.partial(_destroy, out, self._running, self._gl_lock, self.context, self._callbacks)
        if _support.in_callback():  # where cumulet_destroy does nothing
            _support._postponed.append(destroy)
        else:
            destroy()

    def attach(self, get_proc: Callable[[str], Any]) -> None:
        """Attaches a detached viewer to the current context. C: cumulet_attach."""
        receive = _support.callback(api.cumulet_get_proc_fn, _address(get_proc))
        self._call_gl(api.cumulet_attach, receive, None)
        self._callbacks.append(receive)

    def get_sequence_info(self, instance: objects.Instance | None = None
                          ) -> Tuple[_methods.SequenceInfo, List[api.FrameState]]:
        """Returns the state of the sequence, of the viewer or of an instance, and of each of its frames.

        C: cumulet_get_sequence_info, cumulet_get_instance_sequence_info.
        """
        function: Any = api.cumulet_get_sequence_info
        owner: List[Any] = []
        if instance is not None:
            function = api.cumulet_get_instance_sequence_info
            owner = [_support.pointer_of(instance, "Instance", "instance")]
        info = api.cumulet_sequence_info()
        self._call(function, *owner, ctypes.byref(info), None, 0)
        states = (ctypes.c_uint8 * max(info.frames, 1))()
        self._call(function, *owner, ctypes.byref(info), states, info.frames)
        return (_support.unpack(_methods.SequenceInfo, info),
                [_support.known(api.FrameState, state) for state in states[:info.frames]])

    def get_sequence_frame(self, frame: int, instance: objects.Instance | None = None) -> str:
        """Returns why a frame cannot be shown, or "". C: cumulet_get_sequence_frame, cumulet_get_instance_sequence_frame."""
        line = ctypes.create_string_buffer(_support.MAX_LINE)
        if instance is None:
            self._call(api.cumulet_get_sequence_frame, frame, line, len(line))
        else:
            pointer = _support.pointer_of(instance, "Instance", "instance")
            self._call(api.cumulet_get_instance_sequence_frame, pointer, frame, line, len(line))
        return line.value.decode("utf-8", "replace")

    def get_interpolation(self) -> api.Interpolation:
        """Returns the interpolation between voxels that is in use. C: cumulet_get_interpolation."""
        used = ctypes.c_int()
        self._call(api.cumulet_get_interpolation, ctypes.byref(used))
        interpolation: api.Interpolation = _support.known(api.Interpolation, used.value)
        return interpolation

    # Read-back.

    def _read(self, function: Any, floats: int, *arguments: Any) -> memoryview:
        with self._gl_lock:  # no other thread renders in between
            memory, view = _support.new_array(ctypes.c_float, *self._size, floats)
            self._call_gl(function, *arguments, memory, len(memory))
        return view

    def read_cryptomatte(self, name: Callable[[api.ObjectKind, int, int], str | None], ranks: int = 6) -> memoryview:
        """Reads mattes, float32 (height, width, 2 x ranks). C: cumulet_read_cryptomatte.

        name: Receives kind, tag and transform index of an object, and returns its name.
        """
        kept: List[Any] = []

        def address(kind: int, tag: int, index: int) -> int | None:
            given = name(_support.known(api.ObjectKind, kind), tag, index)
            kept.append(ctypes.create_string_buffer((given or "").encode("utf-8")))
            return ctypes.addressof(kept[-1])

        receive = _support.callback(api.cumulet_object_name_fn, address)
        return self._read(api.cumulet_read_cryptomatte, 2 * ranks, receive, None, ranks)

    def set_display_lut(self, values: Any = None, *, shaper: api.LutShaper | str = "linear",
                        domain: Tuple[float, float] = (0.0, 1.0)) -> None:
        """Sets a display LUT, or removes it without values. C: cumulet_set_display_lut.

        values: Encoded colors, float32 (size, size, size, 3), indexed [blue, green, red].
        shaper: The curve before the lattice: "linear", "log2" or "srgb".
        domain: Shaped values at the first and at the last point of an axis.
        """
        if values is None:
            self._call(api.cumulet_set_display_lut, None)
            return
        array = Array(values, "values", "float32", (None, None, None, 3))
        desc = _support.fill(api.cumulet_display_lut_desc, {
            "values": array.view, "size": array.shape[0], "shaper": shaper, "domain_min": domain[0],
            "domain_max": domain[1]})
        self._call(api.cumulet_set_display_lut, ctypes.byref(desc))

    def finish_read(self, read: int) -> memoryview | None:
        """Returns the values of a read, float32 (height, width, channels), or None if it is not ready. Does not wait.

        read: The number that begin_read returned. The call that returns values ends the read.
        C: cumulet_finish_read.
        """
        info = api.cumulet_read_info()
        with self._gl_lock:
            self._call_gl(api.cumulet_finish_read, read, None, 0, ctypes.byref(info))
            if not info.ready:
                return None
            memory, view = _support.new_array(ctypes.c_float, info.height, info.width, info.channels)
            self._call_gl(api.cumulet_finish_read, read, memory, len(memory), ctypes.byref(info))
        return view

    def read_display(self) -> memoryview:
        """Reads the image as it is displayed, uint8 (height, width, 4), straight alpha. C: cumulet_read_display."""
        with self._gl_lock:
            memory, view = _support.new_array(ctypes.c_uint8, *self._size, 4)
            self._call_gl(api.cumulet_read_display, memory, len(memory))
        return view

    def encode_display(self, linear: Any) -> memoryview:
        """Converts linear float32 (height, width, 4) to the bytes of read_display. C: cumulet_encode_display."""
        array = Array(linear, "linear", "float32", (None, None, 4))
        memory, view = _support.new_array(ctypes.c_uint8, *array.shape)
        self._call(api.cumulet_encode_display, array.pointer(), memory, array.count)
        return view

    def read_accumulation(self) -> bytes:
        """Reads the samples of the image, for another process. C: cumulet_read_accumulation."""
        size = ctypes.c_size_t()
        with self._gl_lock:
            self._call_gl(api.cumulet_read_accumulation, None, ctypes.byref(size))
            memory = ctypes.create_string_buffer(size.value)
            self._call_gl(api.cumulet_read_accumulation, memory, ctypes.byref(size))
        return memory.raw[:size.value]

    # Pictures.

    def wait_until_loaded(self) -> None:
        """Waits for the workers, as `wait(-1)`, but Ctrl+C interrupts it."""
        while True:
            try:
                self.wait(WAIT_MS)
                return
            except Error as error:
                if error.status != api.Status.ERROR_TIMEOUT:
                    raise

    def render_picture(self, size: Tuple[int, int], *, progress: bool = True) -> Picture:
        """Renders until the image has all its samples, and reads it back. progress: shows a bar of tqdm, if it is there."""
        self.wait_until_loaded()
        with progress_bar(progress) as show:
            while True:
                result = self.render(width=size[0], height=size[1], budget_ms=FRAME_MS, target=api.FrameTarget.NONE)
                show(result.progress)
                if result.flags & api.RenderFlags.FAILED:
                    failed = self.get_progress()
                    raise Error(failed.message, failed.status)
                if result.flags & api.RenderFlags.CONVERGED:
                    break
                if not result.flags & api.RenderFlags.INCOMPLETE:
                    time.sleep(0.005)  # a worker is busy
        stats = self.get_stats()
        made_by = stats.gl_renderer if self.context is None else f"{self.context.name()}: {stats.gl_renderer}"
        return Picture(self.read_linear(), self.read_display(), made_by, self.measure_noise())


#: Arguments of Viewer.set_sun_sky for a clear day, the default of `render` and of cumulet-render.
DAY: Dict[str, Any] = {"sun_azimuth_degrees": 65.0, "sun_elevation_degrees": 40.0, "sun_irradiance": (4.4, 4.05, 3.55),
       "sky": api.SkyModel.PHYSICAL, "turbidity": 2.5, "ground_albedo": 0.3}
MODELS = (".gltf", ".glb")


def _show(viewer: Viewer, source: Any, medium: Mapping[str, Any]) -> None:
    """Shows a file or an object. A volume gets the suggested density scale if the medium has none."""
    scale = "density_scale" not in medium
    if isinstance(source, (str, os.PathLike)):
        if os.fspath(source).lower().endswith(MODELS):
            viewer.load_surfaces(source)
        else:
            viewer.load_volume_file(source, suggested_density_scale=scale)
    elif isinstance(source, objects.Surfaces):
        viewer.set_surfaces(source)
    elif isinstance(source, objects.Sequence):
        viewer.set_sequence(source)
    elif isinstance(source, objects.DynamicVolume):
        viewer.set_dynamic_volume(source)
    else:
        volume = source if isinstance(source, objects.Volume) else objects.Volume.from_numpy(source)
        viewer.set_volume(volume)
        with contextlib.suppress(Error):  # a volume without density has no scale
            if scale:
                viewer.set_medium(**medium, density_scale=volume.suggest_density_scale())


def render(source: Any, size: Tuple[int, int] = (1280, 720), samples: int = 64, *, camera: Any = None,
           surfaces: Any = None, environment: Any = None, medium: Mapping[str, Any] | None = None,
           grid: Mapping[str, Any] | None = None, sun_sky: Mapping[str, Any] | None = None,
           ground: Mapping[str, Any] | None = None, sampling: Mapping[str, Any] | None = None,
           display: Mapping[str, Any] | None = None, lights: Iterable[Mapping[str, Any]] = (), backend: str = "auto",
           shader_cache: objects.ShaderCache | None = None, log: Callable[[int, str], Any] | None = None,
           progress: bool = True) -> Picture:
    """Renders a picture, in a context without a window. Nothing but a source is needed: the camera fits the scene, and
    light and ground are those of a clear day.

    source: A volume file such as .vdb or .nvdb, a .gltf or .glb file, a float32 array indexed [x, y, z], or a Volume,
        Surfaces, Sequence or DynamicVolume.
    size: Width and height in pixels.
    samples: Samples per pixel.
    camera: A Camera, or a dictionary of its fields.
    surfaces: A glTF file or Surfaces, beside a volume.
    environment: A .hdr or .exr file or an Environment, in place of the day.
    medium, grid, sun_sky, ground, sampling, display: dictionaries of the arguments of Viewer.set_medium and so on.
    lights: See Viewer.set_lights.
    backend: "auto", "egl" or "osmesa".
    progress: Shows a bar of tqdm, if it is there.
    """
    medium = dict(medium or {})
    with Viewer.headless(backend, shader_cache=shader_cache, log=log) as viewer:
        viewer.set_medium(**medium)
        _show(viewer, source, medium)
        if surfaces is not None:
            _show(viewer, surfaces, medium)
        if environment is not None:
            if isinstance(environment, objects.Environment):
                viewer.set_environment(environment)
            else:
                viewer.load_environment(environment)
        elif sun_sky is not None or not lights:
            viewer.set_sun_sky(**(DAY if sun_sky is None else sun_sky))
            if ground is None and sun_sky is None and surfaces is None:
                viewer.set_ground(mode=api.GroundMode.BELOW)
        if ground is not None:
            viewer.set_ground(**ground)
        viewer.set_lights(lights)
        viewer.set_grid(**(grid or {}))
        viewer.set_display(**(display or {}))
        quality: Dict[str, Any] = {"samples": samples, "preview": api.Preview.OFF, **(sampling or {})}
        viewer.set_sampling(**quality)
        if camera is not None:
            viewer.set_camera(camera if isinstance(camera, objects.Camera) else objects.Camera(**camera))
        return viewer.render_picture(size, progress=progress)
