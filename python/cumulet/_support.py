"""Errors, handles, callbacks, and the conversion of arguments and results."""

from __future__ import annotations

import atexit
import collections
import collections.abc
import ctypes
import functools
import itertools
import operator
import os
import threading
import weakref
from typing import Any, Callable, Dict, Iterable, Mapping, Sequence, Tuple, TypeVar, Union

from . import api

PathLike = Union[str, "os.PathLike[str]"]
#: 16 numbers, column by column as in OpenGL, or 4 rows of 4 numbers as in a book.
Matrix = Union[Sequence[float], Sequence[Sequence[float]]]

T = TypeVar("T")
FUNCTION: Any = api.cumulet_release_fn.__mro__[1]  # the base of all types of callbacks in ctypes

MAX_LINE = 1024
AOV_FLOATS = {api.Aov.BEAUTY: 4, api.Aov.VOLUME: 4, api.Aov.NORMAL: 3, api.Aov.ALBEDO: 3, api.Aov.VELOCITY: 3,
              api.Aov.MOTION: 2, api.Aov.VOLUME_MOTION: 2}  # others have 1
PIECE = 1 << 20  # bytes that a stream reads at a time
EXIT_SECONDS = 10.0  # for a running call of another thread, when a viewer is closed


class Error(RuntimeError):
    """A call of the library that failed. The text is one line that names the cause."""

    def __init__(self, line: str, status: int) -> None:
        super().__init__(line)
        #: The status of the call, for example api.Status.ERROR_FILE.
        self.status = api.Status(status)


# --- calls -----------------------------------------------------------------------------------------------------------

_thread = threading.local()


def in_callback() -> bool:
    """Returns whether this thread is in a callback of the library, which must not call the library."""
    return getattr(_thread, "callbacks", 0) > 0


def refuse_in_callback(function: Any) -> None:
    if in_callback():
        raise Error(f"{function.__name__}: a callback must not call the library", api.Status.ERROR_INVALID_ARGUMENT)


def checked_types(function: Any, arguments: Sequence[Any]) -> Any:
    try:
        return function(*arguments)
    except ctypes.ArgumentError as cause:
        number, _, reason = str(cause).partition(": ")
        name = function.names[int(number.split()[-1]) - 1] if number.startswith("argument ") else "?"
        raise TypeError(f"{function.__name__}: {name}: {reason.split(': ')[-1]}") from None


def call(function: Any, *arguments: Any) -> Any:
    """Calls a function of the C API. Raises Error for a status that is not CUMULET_OK."""
    refuse_in_callback(function)
    if function.reports:
        line = ctypes.create_string_buffer(MAX_LINE)
        result = checked_types(function, (*arguments, line, MAX_LINE))
        cause = line.value.decode("utf-8", "replace")
    else:
        result, cause = checked_types(function, arguments), ""
    if function.restype is ctypes.c_int and result != 0:
        cause = cause or api.cumulet_last_error(None).decode("utf-8", "replace")
        text = api.cumulet_status_text(result).decode("utf-8")
        raise Error(cause or f"{function.__name__}: {text}", result)
    return result


def decoded(value: Any) -> Any:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


def callback(kind: Any, function: Callable[..., Any]) -> Any:
    """Returns a C callback that calls a Python function, without the argument `user`. ctypes takes the GIL for it."""
    if not callable(function):
        raise TypeError(f"a function is needed, not {type(function).__name__}")

    def run(_user: Any, *arguments: Any) -> Any:
        _thread.callbacks = getattr(_thread, "callbacks", 0) + 1
        try:
            return function(*map(decoded, arguments))
        finally:
            _thread.callbacks -= 1

    return kind(run)


# --- handles ---------------------------------------------------------------------------------------------------------

_kinds: Dict[str, Any] = {}
_open: "weakref.WeakSet[Handle]" = weakref.WeakSet()
_postponed: collections.deque = collections.deque()  # destructions that a callback must not do
_gate = threading.RLock()  # of the counts of running calls; never held during a call


def destroy_postponed() -> None:
    while _postponed and not in_callback():
        _postponed.popleft()()


class Handle:
    """A handle of the library. It ends with close(), at the end of a `with` block, or with the object."""

    _end: Any = None  # the function of the C API that ends the handle
    _closed_at_exit = 1  # the position in the order of handles that are open at exit
    _calls = 0  # running calls, on any threads

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        if not cls.__name__.endswith("Methods"):
            _kinds[cls.__name__] = cls

    def _adopt(self, out: Any) -> None:
        self._out = out
        _open.add(self)

    @property
    def _pointer(self) -> Any:
        out = self.__dict__.get("_out")
        if not out:
            raise Error(f"{type(self).__name__}: it is closed", api.Status.ERROR_INVALID_ARGUMENT)
        return out

    @property
    def closed(self) -> bool:
        """Whether the handle has ended."""
        return not self.__dict__.get("_out")

    def close(self) -> None:
        """Ends the handle. Objects of the library that use it keep it alive. Does nothing if it has ended."""
        with _gate:
            out = self.__dict__.pop("_out", None)
            if out and self._calls:
                self._ending, out = out, None  # for the last of the running calls
        if out:
            self._release(out)

    def _release(self, out: Any) -> None:
        type(self)._end(out)

    def _call(self, function: Any, *arguments: Any) -> Any:
        with _gate:
            pointer = self._pointer
            self._calls += 1
        try:
            return call(function, pointer, *arguments)
        finally:
            with _gate:
                self._calls -= 1
                out = None if self._calls else self.__dict__.pop("_ending", None)
            if out:
                self._release(out)

    _call_any_time: Any = _call
    _call_gl: Any = _call

    def __enter__(self: T) -> T:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()


def _close_all() -> None:
    destroy_postponed()
    for handle in sorted(list(_open), key=lambda one: one._closed_at_exit):
        handle.close()


atexit.register(_close_all)


def wrap(kind: str, out: Any) -> Any:
    """Returns the object of a handle that the library returned, or None for NULL."""
    if not out:
        return None
    handle = _kinds[kind].__new__(_kinds[kind])
    handle._adopt(out)
    return handle


def pointer_of(value: Any, kind: str, name: str) -> Any:
    if value is None:
        return None
    if not isinstance(value, _kinds[kind]):
        raise TypeError(f"{name}: a {kind} is needed, not {type(value).__name__}")
    return value._pointer


# --- arguments -------------------------------------------------------------------------------------------------------

def text(value: Any) -> bytes | None:
    if value is None:
        return None
    encoded = os.fsencode(value)
    if b"\0" in encoded:
        raise ValueError(f"{value!r} has a zero byte")
    return encoded


def enum_of(kind: Any, value: Any, name: str) -> int:
    """The value of an enum that is given as a constant, or by its name in any case."""
    if isinstance(value, str):
        found = kind.__members__.get(value.upper().replace("-", "_"))
        if found is None:
            raise ValueError(f"{name}: '{value}' is none of {', '.join(one.lower() for one in kind.__members__)}")
        return found
    return operator.index(value)


def floats_of(aov: Any) -> int:
    """Floats per pixel of an AOV."""
    return AOV_FLOATS.get(known(api.Aov, enum_of(api.Aov, aov, "aov")), 1)


def numbers(kind: Any, count: int, value: Any, name: str) -> Any:
    """A C array of so many numbers. 16 may also be 4 rows of 4."""
    try:
        flat = list(value)
        if count == 16 and len(flat) == 4:
            flat = [flat[row][column] for column in range(4) for row in range(4)]
        if len(flat) == count:
            return (kind * count)(*flat)
    except (TypeError, IndexError):
        raise TypeError(f"{name}: {count} numbers are needed, not {value!r}") from None
    raise ValueError(f"{name}: {count} numbers are needed, not {len(flat)}")


def doubles(value: Any, name: str) -> Any:
    """A C array of numbers, or of rows of numbers. For short arrays, of which a copy is cheap."""
    try:
        flat: list[float] = []
        for one in value:
            flat.extend(one if isinstance(one, collections.abc.Iterable) else [one])
        return (ctypes.c_double * len(flat))(*flat)
    except TypeError:
        raise TypeError(f"{name}: numbers or rows of numbers are needed, not {value!r}") from None


def integer(kind: Any, value: Any, name: str) -> int:
    try:
        index = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: an integer is needed, not {value!r}") from None
    if kind(index).value != index:
        raise ValueError(f"{name}: {index} is out of range")
    return index


def number(value: Any, name: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: a number is needed, not {value!r}") from None


def converter(struct: Any, name: str, kind: Any) -> Callable[[Any], Any]:
    """The function that converts an argument to a field of a struct."""
    if name in struct._enums_:
        return lambda value: enum_of(struct._enums_[name], value, name)
    if kind in (ctypes.c_double, ctypes.c_float):
        return lambda value: number(value, name)
    if kind is ctypes.c_char_p:
        return text
    if kind is ctypes.c_void_p:
        return lambda value: value
    if issubclass(kind, ctypes.Array):
        return lambda value: numbers(kind._type_, kind._length_, value, name)
    if issubclass(kind, FUNCTION):
        return lambda value: value if isinstance(value, kind) else callback(kind, value)
    if not issubclass(kind, ctypes._Pointer):
        return lambda value: integer(kind, value, name)
    target = kind._type_
    if name in struct._counts_:
        if target is ctypes.c_char_p:
            return texts
        if issubclass(target, api.Struct):
            return lambda value: structs(target, value, name)
        if target is ctypes.c_double:
            return lambda value: doubles(value, name)
        return lambda value: Array(value, name, SCALARS[target])
    if issubclass(target, api.Struct):
        return lambda value: ctypes.pointer(fill_from(target, value, name))
    handle = "".join(part.capitalize() for part in target.__name__.split("_")[1:])
    return lambda value: pointer_of(value, handle, name)


_converters: Dict[Any, Dict[str, Callable[[Any], Any]]] = {}


def converters_of(struct: Any) -> Dict[str, Callable[[Any], Any]]:
    if struct not in _converters:
        _converters[struct] = {name: converter(struct, name, kind) for name, kind in struct._fields_
                               if name != "struct_size"}
    return _converters[struct]


def fill(struct: Any, values: Mapping[str, Any]) -> Any:
    """A struct with the fields that `values` has and that are not None. It keeps the memory that it refers to."""
    filled = struct()
    for name, convert in converters_of(struct).items():
        value = values.get(name)
        if value is None and any(values.get(one) is not None for one in struct._enables_.get(name, ())):
            value = True
        if value is None:
            continue
        value = convert(value)
        if name in struct._counts_:
            value = set_array(filled, name, value)
        setattr(filled, name, value)
    return filled


def set_array(struct: Any, name: str, value: Any) -> Any:
    """Sets the length of an array in its struct, and returns the pointer to it."""
    field, per_count = struct._counts_[name]
    length = value.count if isinstance(value, Array) else len(value)
    count, rest = divmod(length, per_count)
    present = getattr(struct, field)
    if rest or present not in (0, count):
        raise ValueError(f"{name}: it has {length} values, not {per_count} for each of {present or count + 1}")
    setattr(struct, field, count)
    struct.__dict__.setdefault("kept", []).append(value)
    return value.pointer() if isinstance(value, Array) else ctypes.cast(value, dict(struct._fields_)[name])


def fill_from(struct: Any, values: Any, name: str) -> Any:
    """A struct from a mapping, or from the named tuple that a method returned. Unknown names are refused."""
    if hasattr(values, "_asdict"):
        values = values._asdict()
    if not isinstance(values, collections.abc.Mapping):
        raise TypeError(f"{name}: a dictionary of fields is needed, not {type(values).__name__}")
    unknown = sorted(set(values) - set(converters_of(struct)))
    if unknown:
        raise TypeError(f"{name}: there is no field '{unknown[0]}'; {struct.__name__} has "
                        f"{', '.join(converters_of(struct))}")
    return fill(struct, values)


# C arrays from Python's sequences.

def structs(struct: Any, values: Iterable[Any], name: str) -> Any:
    filled = [fill_from(struct, value, name) for value in values]
    result = (struct * len(filled))(*filled)
    result.kept = filled  # with the memory that they refer to
    return result


def texts(values: Iterable[Any]) -> Any:
    encoded = [text(value) for value in values]
    return (ctypes.c_char_p * len(encoded))(*encoded)


def groups(kind: Any, size: int, values: Iterable[Any], name: str) -> Any:
    """A C array of groups of so many numbers, for example of matrices."""
    try:
        flat = [numbers(kind, size, value, name) for value in values]
    except TypeError:
        raise TypeError(f"{name}: groups of {size} numbers are needed, not {values!r}") from None
    return (kind * (size * len(flat)))(*itertools.chain.from_iterable(flat))


def matrix(value: Any, name: str) -> Any:
    return None if value is None else numbers(ctypes.c_double, 16, value, name)


def seconds(value: Any, name: str) -> Any:
    return None if value is None else (ctypes.c_double * 1)(number(value, name))


def length_of(first: Any, *others: Any) -> int:
    """The common length of arguments that are sequences."""
    if any(len(other) != len(first) for other in others):
        raise ValueError(f"there are {len(others[0])} for {len(first)}")
    return len(first)


def bytes_of(values: Any, name: str) -> Any:
    array = Array(values, name, "uint8")
    return array.pointer(), array.count


def stream_of(file: Any, raised: list[BaseException]) -> Any:
    """The content of a binary file object. Exceptions of its methods are added to a list."""
    def read(position: int, address: int, size: int) -> int:
        try:
            file.seek(position)
            done = 0
            while done < size:
                piece = file.read(min(size - done, PIECE))
                if not piece:
                    break
                ctypes.memmove(address + done, piece, len(piece))
                done += len(piece)
            return done
        except BaseException as cause:
            raised.append(cause)
            return 0

    return fill(api.cumulet_stream_desc, {"size": file.seek(0, os.SEEK_END), "read": read})


def from_stream(kind: str, function: Any, file: Any, described: Any) -> Any:
    """The handle that a function of the C API creates from a file object."""
    raised: list[BaseException] = []
    stream = stream_of(file, raised)
    out = function.argtypes[2]._type_()
    try:
        call(function, ctypes.byref(stream), described, ctypes.byref(out))
    except Error:
        if raised:
            raise raised[0] from None
        raise
    return wrap(kind, out)


# --- arrays ----------------------------------------------------------------------------------------------------------

class _PyBuffer(ctypes.Structure):
    _fields_ = [("buf", ctypes.c_void_p), ("obj", ctypes.py_object), ("len", ctypes.c_ssize_t),
                ("itemsize", ctypes.c_ssize_t), ("readonly", ctypes.c_int), ("ndim", ctypes.c_int),
                ("format", ctypes.c_char_p), ("shape", ctypes.c_void_p), ("strides", ctypes.c_void_p),
                ("suboffsets", ctypes.c_void_p), ("internal", ctypes.c_void_p)]


TYPES = {"f": "float32", "d": "float64", "e": "float16", "b": "int8", "B": "uint8", "h": "int16", "H": "uint16",
         "i": "int32", "I": "uint32", "l": "int64", "L": "uint64", "q": "int64", "Q": "uint64", "?": "bool"}
SCALARS = {ctypes.c_float: "float32", ctypes.c_int32: "int32", ctypes.c_uint32: "uint32", ctypes.c_uint64: "uint64",
           ctypes.c_uint8: "uint8"}


class Array:
    """The memory of an object with the buffer protocol, which is not copied. It stays valid as long as this object."""

    def __init__(self, values: Any, name: str, kind: str = "float32", shape: Sequence[int | None] | None = None) -> None:
        remedy = f"numpy.ascontiguousarray({name}, numpy.{kind}) converts it"
        try:
            self.view = memoryview(values)
        except TypeError:
            raise TypeError(f"{name}: an array of {kind} is needed, not {type(values).__name__}; {remedy}") from None
        order, code = self.view.format[:-1], self.view.format[-1]
        found = TYPES.get(code) if order in ("", "@", "=", "<") else None
        if found != kind:
            raise TypeError(f"{name}: its values are {found or repr(self.view.format)}, not {kind}; {remedy}")
        if not self.view.c_contiguous:
            raise ValueError(f"{name}: it is not C-contiguous (strides {self.view.strides}); {remedy}")
        self.shape, self.kind = tuple(self.view.shape or ()), kind
        if shape is not None and (len(shape) != len(self.shape)
                                  or any(wanted not in (None, one) for wanted, one in zip(shape, self.shape))):
            wanted_shape = ", ".join("n" if one is None else str(one) for one in shape)
            raise ValueError(f"{name}: its shape is {self.shape}, not ({wanted_shape})")
        self.count = self.view.nbytes // self.view.itemsize
        buffer = _PyBuffer()
        ctypes.pythonapi.PyObject_GetBuffer(ctypes.py_object(self.view), ctypes.byref(buffer), ctypes.c_int(0))
        self.address = buffer.buf  # valid as long as the memoryview
        ctypes.pythonapi.PyBuffer_Release(ctypes.byref(buffer))

    def pointer(self) -> Any:
        kind: Any = next(one for one, name in SCALARS.items() if name == self.kind)
        return ctypes.cast(self.address, ctypes.POINTER(kind))


def new_array(kind: Any, *shape: int) -> Tuple[Any, memoryview]:
    """Memory for so many values of float or byte, as a C array and as a memoryview with that shape."""
    count = functools.reduce(operator.mul, shape)
    memory = (kind * max(count, 1))()
    view = memoryview(memory).cast("B")[:ctypes.sizeof(kind) * count]
    return memory, view.cast("f" if kind is ctypes.c_float else "B", shape=shape) if count else view


# --- results ---------------------------------------------------------------------------------------------------------

def known(kind: Any, value: int) -> Any:
    """The constant of an enum, or the number if a newer library returned it."""
    try:
        return kind(value)
    except ValueError:
        return value


def unpack(result: Any, struct: Any) -> Any:
    """The named tuple of a struct that the library filled."""
    values = []
    for name in result._fields:
        value = getattr(struct, name)
        if name in struct._enums_:
            value = known(struct._enums_[name], value)
        elif isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        elif isinstance(value, ctypes.Array):
            value = tuple(value)
        elif name in struct._flags_:
            value = bool(value)
        values.append("" if value is None else value)
    return result._make(values)


# --- versions --------------------------------------------------------------------------------------------------------

def version_text() -> str:
    version = api.cumulet_version()
    return f"{version // 10000}.{version // 100 % 100}.{version % 100}"


def check_version() -> None:
    if api.cumulet_version() // 100 != 100 * api.VERSION[0] + api.VERSION[1]:
        raise ImportError("cumulet: the package is of version {}.{}, the library of {}".format(
            *api.VERSION, version_text()))
