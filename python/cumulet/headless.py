"""OpenGL contexts without a display and a window, by libcumulet_headless."""

from . import _headless_methods


class Headless(_headless_methods.HeadlessMethods):
    _closed_at_exit = 2  # after the viewers
