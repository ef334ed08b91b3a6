"""Volumes, surfaces, environments, cameras and other objects that viewers show."""

from __future__ import annotations

import ctypes
import itertools
from typing import Any, Dict, List, Mapping, Sequence as SequenceOf, Tuple

from . import _methods, _support, api
from ._methods import Camera, Inspection, Instance, Model, Sequence, ShaderCache  # noqa: F401
from ._support import Array, Matrix, PathLike

CHANNELS = {name.lower(): channel for name, channel in api.Channel.__members__.items()}


def lattice(index_to_world: Matrix | None, voxel_size: float | None, origin: SequenceOf[float] | None) -> Any:
    """The transform from voxels to the world: the matrix, or a scale and the position of voxel [0, 0, 0]."""
    if index_to_world is not None:
        if voxel_size is not None or origin is not None:
            raise TypeError("index_to_world already has a voxel size and an origin")
        return _support.numbers(ctypes.c_double, 16, index_to_world, "index_to_world")
    size = 1.0 if voxel_size is None else _support.number(voxel_size, "voxel_size")
    corner = _support.numbers(ctypes.c_double, 3, (0, 0, 0) if origin is None else origin, "origin")
    return (ctypes.c_double * 16)(size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, *corner, 1)


def dense(values: Any, name: str, matrix: Any, axes: str) -> Dict[str, Any]:
    """Fields of cumulet_dense_desc. The library's x is the last axis of an array; the columns of the matrix follow."""
    array = Array(values, name, "float32", (None, None, None))
    if axes == "xyz":
        matrix = [*matrix[8:12], *matrix[4:8], *matrix[0:4], *matrix[12:16]]
    elif axes != "zyx":
        raise ValueError(f"axes: '{axes}' is neither xyz nor zyx")
    return {"values": array.view, "size": array.shape[::-1], "index_to_world": matrix}


def fields_of(channels: Mapping[str, Any], matrix: Any, axes: str) -> List[Dict[str, Any]]:
    """A dictionary of fields of cumulet_field for each channel with an array."""
    unknown = [name for name in channels if name not in CHANNELS]
    if unknown:
        raise TypeError(f"there is no channel '{unknown[0]}'; channels are {', '.join(CHANNELS)}")
    return [{"channel": CHANNELS[name], "dense": dense(values, name, matrix, axes)}
            for name, values in channels.items() if values is not None]


class Volume(_methods.VolumeMethods):
    """Immutable voxels. Created by from_file, from_bytes, from_stream, from_numpy, from_fields, and the functions of the
    C API from_dense, from_sparse and from_states."""

    @classmethod
    def from_stream(cls, file: Any, name: str = "stream", **grids: Any) -> Volume:
        """Creates a volume from a binary file object with seek and read, for example an entry of a ZipFile.

        name: Name in messages.
        grids: The keyword arguments of from_file.

        C: cumulet_volume_from_stream.
        """
        described = _support.fill_from(api.cumulet_volume_file_desc, {"path": name, **grids}, "grids")
        return _support.from_stream("Volume", api.cumulet_volume_from_stream, file, ctypes.byref(described))

    @classmethod
    def from_numpy(cls, density: Any, *, voxel_size: float | None = None, origin: SequenceOf[float] | None = None,
                   index_to_world: Matrix | None = None, axes: str = "xyz", name: str | None = None) -> Volume:
        """Creates a volume from densities: a C-contiguous float32 array, indexed [x, y, z].

        voxel_size: Width of a voxel in world units. None: 1.
        origin: Position of the center of voxel [0, 0, 0]. None: the world's origin.
        index_to_world: The whole transform, in place of voxel_size and origin.
        axes: "xyz", or "zyx" for an array that is indexed [z, y, x].
        name: Name in messages.
        """
        matrix = lattice(index_to_world, voxel_size, origin)
        return cls.from_dense(**dense(density, "density", matrix, axes), name=name)

    @classmethod
    def from_fields(cls, *, voxel_size: float | None = None, origin: SequenceOf[float] | None = None,
                    index_to_world: Matrix | None = None, axes: str = "xyz", name: str | None = None,
                    **channels: Any) -> Volume:
        """Creates a volume with several channels, each an array as in from_numpy.

        channels: density, temperature, flame, red, green, blue, anisotropy, velocity_x, velocity_y, velocity_z.
        """
        matrix = lattice(index_to_world, voxel_size, origin)
        return cls.from_states(fields=fields_of(channels, matrix, axes), name=name)


# Arrays that the library reads in place, until it calls _give_back with their number.
_lent: Dict[int, Any] = {}
_next_number = itertools.count(1)


@api.cumulet_release_fn
def _give_back(number: int) -> None:
    _lent.pop(number, None)


class DynamicVolume(_methods.DynamicVolumeMethods):
    """A volume whose content is replaced while viewers show it."""

    def set(self, density: Any = None, *, voxel_size: float | None = None, origin: SequenceOf[float] | None = None,
            index_to_world: Matrix | None = None, axes: str = "xyz", name: str | None = None, copy: bool = True,
            **channels: Any) -> None:
        """Submits a state, with the arguments of Volume.from_fields. Viewers show the newest state.

        copy: True: the library copies the arrays before the call returns. False: it reads them later, in place, and
            they must not change any more.
        """
        matrix = lattice(index_to_world, voxel_size, origin)
        fields = fields_of({"density": density, **channels}, matrix, axes)
        if copy:
            self.set_state(fields=fields, name=name)
            return
        number = next(_next_number)
        desc = _support.fill(api.cumulet_volume_fields_desc, {"fields": fields, "name": name, "release": _give_back})
        desc.release_user = number
        _lent[number] = desc
        try:
            self._call(api.cumulet_dynamic_volume_set, ctypes.byref(desc))
        except BaseException:
            _lent.pop(number, None)
            raise


class Surfaces(_methods.SurfacesMethods):
    """Immutable meshes. Created by from_file, from_bytes or from_triangles."""


class Environment(_methods.EnvironmentMethods):
    """An environment map. Created by from_file, from_bytes, from_stream or from_pixels."""

    @classmethod
    def from_stream(cls, file: Any, name: str = "stream") -> Environment:
        """Creates an environment from a binary file object with seek and read. C: cumulet_environment_from_stream.

        name: Name in messages.
        """
        return _support.from_stream("Environment", api.cumulet_environment_from_stream, file, _support.text(name))

    @classmethod
    def from_pixels(cls, values: Any, *, name: str | None = None) -> Environment:
        """Creates an environment from linear radiance, float32 (height, width, 3)."""
        array = Array(values, "values", "float32", (None, None, 3))
        return cls.from_values(values=array.view, width=array.shape[1], height=array.shape[0], name=name)

    def get_pixels(self, width: int, height: int) -> memoryview:
        """Returns the environment at some size, float32 (height, width, 3). C: cumulet_environment_get_pixels."""
        memory, view = _support.new_array(ctypes.c_float, height, width, 3)
        self._call(api.cumulet_environment_get_pixels, width, height, memory, len(memory))
        return view


def list_grids(path: PathLike) -> List[Tuple[str, str, str]]:
    """Returns (name, type, reason) of each grid of a volume file. The reason is "" if the grid can be shown."""
    grids: List[Tuple[str, str, str]] = []
    receive = _support.callback(api.cumulet_grid_fn, lambda name, kind, reason: grids.append((name, kind, reason)))
    _support.call(api.cumulet_list_grids, _support.text(path), receive, None)
    return grids
