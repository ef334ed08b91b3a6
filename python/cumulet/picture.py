"""Finished pictures, and their files."""

from __future__ import annotations

import array
import contextlib
import math
import os
import struct
import sys
import warnings
import zlib
from typing import Any, Callable, Iterator

from ._support import PathLike


@contextlib.contextmanager
def progress_bar(wanted: bool) -> Iterator[Callable[[float], None]]:
    """A function that shows the finished part, with tqdm if it is there: in a terminal or a notebook."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # in a notebook without ipywidgets, where a bar of text does
            from tqdm.auto import tqdm
    except ImportError:
        wanted = False
    if not wanted:
        yield lambda part: None
        return
    hidden: Any = False if "ipykernel" in sys.modules else None  # None: only in a terminal
    with tqdm(total=100, unit="%", disable=hidden) as bar:
        def show(part: float) -> None:
            bar.update(max(0, round(100 * part) - bar.n))

        yield show


class Picture:
    """A finished picture. It needs no context. Notebooks show it."""

    def __init__(self, linear: memoryview, display: memoryview, driver: str, noise: float = math.inf) -> None:
        #: Linear radiance and alpha, float32 (height, width, 4), first pixel top left.
        self.linear = linear
        #: The same as it is displayed, uint8 (height, width, 4), straight alpha.
        self.display = display
        #: The context and the driver that rendered it.
        self.driver = driver
        #: The relative standard error of the luminance; 0.02 is 2 %. Infinite if it is unknown.
        self.noise = noise
        self.height, self.width = tuple(display.shape or ())[:2]

    def numpy(self) -> Any:
        """Linear radiance and alpha as a NumPy array of float32 (height, width, 4), which is not copied."""
        import numpy
        return numpy.asarray(self.linear)

    def png(self) -> bytes:
        """The displayed picture as the bytes of a PNG file."""
        flat = self.display.cast("B")
        row = 4 * self.width
        rows = b"".join(b"\0" + flat[y * row:(y + 1) * row] for y in range(self.height))
        header = struct.pack(">IIBBBBB", self.width, self.height, 8, 6, 0, 0, 0)
        chunks = ((b"IHDR", header), (b"sRGB", b"\0"), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
        return b"\x89PNG\r\n\x1a\n" + b"".join(
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
            for kind, data in chunks)

    def exr(self) -> bytes:
        """The linear radiance as the bytes of an OpenEXR file, without compression."""
        def attribute(name: str, kind: str, data: bytes) -> bytes:
            return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

        def floats(values: array.array) -> bytes:
            if sys.byteorder == "big":
                values.byteswap()
            return values.tobytes()

        channels = b"".join(c + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for c in (b"A", b"B", b"G", b"R")) + b"\0"
        window = struct.pack("<iiii", 0, 0, self.width - 1, self.height - 1)
        header = b"\x76\x2f\x31\x01\x02\0\0\0" + b"".join((
            attribute("channels", "chlist", channels), attribute("compression", "compression", b"\0"),
            attribute("dataWindow", "box2i", window), attribute("displayWindow", "box2i", window),
            attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
            attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
            attribute("screenWindowWidth", "float", struct.pack("<f", 1)))) + b"\0"
        values = array.array("f", self.linear.cast("B").cast("f"))
        row = 4 * self.width
        size = 8 + 4 * row
        first = len(header) + 8 * self.height
        offsets = struct.pack(f"<{self.height}Q", *(first + size * y for y in range(self.height)))
        lines = [struct.pack("<ii", y, 4 * row) + b"".join(floats(values[y * row + c:(y + 1) * row:4])
                                                           for c in (3, 2, 1, 0)) for y in range(self.height)]
        return header + offsets + b"".join(lines)

    def save(self, path: PathLike) -> None:
        """Writes a file: .png as displayed, .exr as linear radiance."""
        suffix = os.path.splitext(os.fspath(path))[1].lower()
        formats = {".png": self.png, ".exr": self.exr}
        if suffix not in formats:
            raise ValueError(f"{os.fspath(path)}: pictures are saved as {' or '.join(formats)}")
        data = formats[suffix]()
        with open(path, "wb") as file:
            file.write(data)

    _repr_png_ = png  # for notebooks

    def __repr__(self) -> str:
        return f"<cumulet.Picture {self.width}x{self.height}, {self.driver}>"
