"""Path-traced volumes.

    import cumulet
    cumulet.render("cloud.vdb", size=(640, 360), samples=64).save("cloud.png")

Viewer, Volume and the other classes are those of the C API: a method has the name of its function without the prefix,
and the fields of its descriptor are keyword arguments. `cumulet.api` has all functions under their C names. Failed calls
raise cumulet.Error. docs/python.md describes the package.
"""

import sys

if sys.version_info < (3, 8):
    raise ImportError("cumulet needs Python 3.8 or later; this is {}.{}.{}".format(*sys.version_info[:3]))

import ctypes  # noqa: E402

from . import _support, api  # noqa: E402
from ._support import Error  # noqa: E402
from .enums import *  # noqa: E402,F401,F403
from .objects import (Camera, DynamicVolume, Environment, Inspection, Instance, Model, Sequence,  # noqa: E402,F401
                      ShaderCache, Surfaces, Volume, list_grids)
from .picture import Picture  # noqa: E402,F401
from .viewer import DAY, Viewer, get_proc, render  # noqa: E402,F401

_support.check_version()
Error.__module__ = __name__
__version__ = _support.version_text()


def __getattr__(name):
    """Loads libcumulet_headless only for those who use it."""
    if name == "Headless":
        from .headless import Headless
        return Headless
    raise AttributeError(f"module 'cumulet' has no attribute '{name}'")


def region_pixels(region, width, height):
    """Returns x, y, width and height of a region in pixels. C: cumulet_region_pixels."""
    pixels = (ctypes.c_uint32 * 4)()
    corner = _support.numbers(ctypes.c_float, 4, region, "region")
    _support.call(api.cumulet_region_pixels, corner, width, height, pixels)
    return tuple(pixels)


def cryptomatte_id(name):
    """The Cryptomatte id of a name. C: cumulet_cryptomatte_id."""
    return api.cumulet_cryptomatte_id(_support.text(name))


def transmittance_map_glsl():
    """The GLSL functions that read a transmittance map. C: cumulet_transmittance_map_glsl."""
    return api.cumulet_transmittance_map_glsl().decode("utf-8")
