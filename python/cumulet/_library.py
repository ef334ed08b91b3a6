"""Finds and loads the shared libraries, and makes their functions callable."""

import ctypes
import os
from typing import Any, Dict, Tuple

# Folders that are searched before the loader's own. The folder "lib" of this package exists in a wheel and in a build.
VARIABLE = "CUMULET_LIBRARY_DIR"
OWN_FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "lib")

_loaded: Dict[str, Any] = {}


class Struct(ctypes.Structure):
    """A struct of the C API. Its struct_size is set, and the rest is zero, which means the defaults."""

    _enums_: Dict[str, Any] = {}  # the enum of a field
    _counts_: Dict[str, Tuple[str, int]] = {}  # the field with the length of an array, and elements per count
    _flags_: Dict[str, type] = {}  # fields of int32_t that are 0 or 1
    _enables_: Dict[str, Tuple[str, ...]] = {}  # flags that are 1 by default if one of these fields is given

    def __init__(self, **values):
        super().__init__(**values)
        if self._fields_[0][0] == "struct_size":
            self.struct_size = ctypes.sizeof(self)


def load_shared_with_drivers():
    """Loads the system's copies of libraries that a GL driver also loads, so that the wheel's are used only without."""
    folder = os.path.join(OWN_FOLDER, "fallback")
    for file in os.listdir(folder) if os.path.isdir(folder) else ():
        try:
            ctypes.CDLL(file)
        except OSError:
            pass  # the loader finds the wheel's copy


def load(name):
    """Returns the library lib<name>.so.0."""
    if name in _loaded:
        return _loaded[name]
    file = "lib{}.so.0".format(name)
    folders = [folder for folder in (os.environ.get(VARIABLE), OWN_FOLDER) if folder]
    found = [os.path.join(folder, file) for folder in folders if os.path.exists(os.path.join(folder, file))]
    path = found[0] if found else file
    load_shared_with_drivers()
    try:
        _loaded[name] = ctypes.CDLL(path)
    except OSError as cause:
        hint = "" if found else "; {} names the folder of the library".format(VARIABLE)
        raise ImportError("cumulet: {}{}".format(cause, hint)) from None
    return _loaded[name]


def function(library, name, result, arguments, names, doc):
    """Returns a function of a library. names: of its parameters, for messages."""
    try:
        found = getattr(load(library), name)
    except AttributeError:
        raise ImportError("cumulet: lib{}.so.0 has no {}; it is of another version than this package".format(
            library, name)) from None
    found.restype, found.argtypes = result, arguments
    found.names = names.split()
    found.reports = "error_size" in found.names
    found.__doc__ = doc
    return found
