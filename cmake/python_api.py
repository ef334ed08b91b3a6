"""Writes the parts of the Python package that follow from a C header.

--enums    a module with the enums
--api      a module with the structs, callbacks, functions and constants of the header, by ctypes, under their C names
--stubs    the same as type hints (.pyi)
--methods  a module with a class of methods per handle, with keyword arguments for the fields of descriptors

A function becomes a method if its parameters are numbers, texts, handles and descriptors, and its results numbers,
handles and structs. python/cumulet has the others by hand. tests/python/coverage_test.py finds functions without either.
"""
import argparse
import re

import c_header
import descriptors

SCALARS = {"char": "c_char", "double": "c_double", "float": "c_float", "int32_t": "c_int32", "size_t": "c_size_t",
           "uint8_t": "c_uint8", "uint32_t": "c_uint32", "uint64_t": "c_uint64"}
# Enums without a name that are sets of bits, by the prefix of their constants.
BITS = {"CUMULET_RENDER_": "RenderFlags", "CUMULET_MODIFIER_": "Modifiers"}
NUMBERS = {"key"} | descriptors.COUNTED  # int32_t members that are numbers, not booleans
PATHS = {"path", "folder", "shaders", "network", "oidn_library"}
# Members that are arrays: the member with their length, and elements per count.
COUNTS = {"values": ("value_count", 1), "brick_origins": ("brick_count", 3), "brick_values": ("brick_count", 512),
          "brick_active": ("brick_count", 8), "tiles": ("tile_count", 1), "fields": ("field_count", 1),
          "positions": ("vertex_count", 3), "normals": ("vertex_count", 3), "colors": ("vertex_count", 4),
          "velocities": ("vertex_count", 3), "indices": ("index_count", 1), "meshes": ("mesh_count", 1),
          "changed": ("changed_count", 1), "paths": ("count", 1), "planes": ("plane_count", 4)}
# Flags that are set if members that need them are given: without the flag, the library would ignore these.
ENABLES = {"cumulet_clip_desc": {"box": ("box_min", "box_max")}}
# Functions that read the image back: floats per pixel, as an expression.
READS = {"cumulet_read_linear": "4", "cumulet_read_denoised": "4", "cumulet_read_light_group": "3",
         "cumulet_read_aov": "_support.floats_of(aov)"}
# Functions that create a handle, and the method that calls them.
CREATE = {"cumulet_camera_create": "__init__", "cumulet_dynamic_volume_create": "__init__",
          "cumulet_shader_cache_create": "__init__", "cumulet_model_create": "__init__",
          "cumulet_instance_create": "__init__", "cumulet_inspect_volume_file": "__init__",
          "cumulet_headless_create": "__init__", "cumulet_surfaces_open": "from_file",
          "cumulet_environment_open": "from_file", "cumulet_volume_open_file": "from_file",
          "cumulet_sequence_create": "__init__", "cumulet_volume_from_dense": "from_dense",
          "cumulet_volume_from_memory": "from_bytes", "cumulet_environment_from_memory": "from_bytes",
          "cumulet_volume_from_sparse": "from_sparse", "cumulet_volume_from_fields": "from_states",
          "cumulet_surfaces_from_memory": "from_bytes", "cumulet_surfaces_from_triangles": "from_triangles",
          "cumulet_environment_from_pixels": "from_values"}
# Handles whose methods all follow from the header. python/cumulet derives its classes from those of the others.
WHOLE = {"cumulet_camera", "cumulet_inspection", "cumulet_instance", "cumulet_model", "cumulet_sequence",
         "cumulet_shader_cache"}
# Methods whose names do not follow from those of the functions.
RENAMED = {"cumulet_dynamic_volume_set": "set_state"}
# Functions that other methods call, or that end handles.
OTHERWISE = re.compile(r"_(?:retain|release|destroy|get_proc)$|^cumulet_(?:last_error|volume_open|set_display_lut)$")
ANY_TIME = "Threads: any thread, at any time"
INDENT = "        "


def camel(name):
    return "Status" if name == "cumulet_status" else descriptors.camel(name)


def base(c_type):
    """The type that a pointer points to, or the type itself."""
    return c_type.replace("const ", "").replace(" const", "").rstrip("*").strip()


def quoted(text, indent):
    """A docstring."""
    text = text.replace("\\", "\\\\").replace('"""', "'''").replace("@ref ", "")
    lines = [f'{indent}"""{text}'.split("\n")[0], *(f"{indent}{line}".rstrip() for line in text.split("\n")[1:])]
    return "\n".join(lines) + ('"""' if len(lines) == 1 else f'\n{indent}"""')


class Generator:
    def __init__(self, path, types):
        self.header = c_header.Header(path)
        # Types of this header, and of those that it includes.
        headers = [self.header, *(c_header.Header(one) for one in types)]
        self.enums = {e.name: e for h in headers for e in h.of(c_header.Enum) if e.name}
        self.structs = {s.name: s for h in headers for s in h.of(c_header.Struct)}
        self.handles = {h.name: h for one in headers for h in one.of(c_header.Handle)}
        functions = [f for h in headers for f in h.of(c_header.Function)]
        self.callbacks = {f.name: f for f in functions if f.name.endswith("_fn")}
        self.functions = [f for f in self.header.of(c_header.Function) if f.name not in self.callbacks]
        self.sizes = {name: value for h in headers for e in h.of(c_header.Enum) if not e.name
                      for name, value, _ in e.constants}

    # The low-level module.

    def ctype(self, c_type, length=None, in_struct=False):
        """The ctypes expression of a type."""
        stars, name = c_type.count("*"), base(c_type)
        if name in SCALARS or name in self.enums:
            element = f"ctypes.{SCALARS.get(name, 'c_int')}"
        else:
            element = name
        if length:
            return f"{element} * {self.sizes.get(length, length)}" if in_struct else f"ctypes.POINTER({element})"
        if name == "void":
            return "ctypes.c_void_p" if stars else "None"
        if name == "char" and stars:
            return "ctypes.c_char_p" if stars == 1 else "ctypes.POINTER(ctypes.c_char_p)"
        return "ctypes.POINTER(" * stars + element + ")" * stars

    @staticmethod
    def enum_names(enum):
        """The name of the Python class, None for plain numbers, and the prefix of its constants in C."""
        names = [name for name, _, _ in enum.constants]
        prefix = c_header.common_prefix(names) if len(names) > 1 else ""
        return (camel(enum.name) if enum.name else BITS.get(prefix)), prefix

    def enum(self, enum):
        name, prefix = self.enum_names(enum)
        lines = [f"class {name}(enum.{'IntEnum' if enum.name else 'IntFlag'}):", quoted(enum.doc or name, "    "), ""]
        for constant, value, doc in enum.constants:
            lines += [f"    #: {line}" for line in doc.split("\n") if line]
            lines.append(f"    {constant[len(prefix):]} = {value}")
        return lines

    def constants(self, enum):
        """The constants under their C names."""
        name, prefix = self.enum_names(enum)
        return [f"{c} = {name}.{c[len(prefix):]}" if name else f"{c} = {value}" for c, value, _ in enum.constants]

    def enum_module(self):
        enums = [one for one in self.header.of(c_header.Enum) if self.enum_names(one)[0]]
        parts = ['"""The enums of the C API. Made by cmake/python_api.py."""', "", "import enum", "",
                 f"__all__ = {[self.enum_names(one)[0] for one in enums]!r}"]
        for one in enums:
            parts += ["", "", *self.enum(one)]
        return parts

    def struct(self, struct):
        fields = [f'    ("{m.name}", {self.ctype(m.type, m.length, True)}),' for m in struct.members]
        enums = ", ".join(f'"{m.name}": {camel(m.type)}' for m in struct.members if m.type in self.enums)
        counts = ", ".join(f'"{m.name}": {COUNTS[m.name]!r}' for m in struct.members if self.is_array(struct, m))
        flags = ", ".join(f'"{m.name}": bool' for m in struct.members
                          if m.type == "int32_t" and not m.length and m.name not in NUMBERS)
        doc = "\n\n".join([struct.doc, *(f"{m.name}: {m.doc}" for m in struct.members if m.doc)])
        enables = [f"    _enables_ = {ENABLES[struct.name]!r}"] if struct.name in ENABLES else []
        return [f"class {struct.name}(Struct):", quoted(doc, "    "), f"    _enums_ = {{{enums}}}",
                f"    _counts_ = {{{counts}}}", f"    _flags_ = {{{flags}}}", *enables, "    _fields_ = [",
                *(f"    {field}" for field in fields), "    ]"]

    def callback(self, function):
        result = self.ctype(function.result)
        # ctypes cannot return a text that stays valid: the callback returns its address.
        result = "ctypes.c_void_p" if function.result == "const char*" else result
        types = [result, *(self.ctype(p.type, p.length) for p in function.parameters)]
        return [f"{function.name} = ctypes.CFUNCTYPE({', '.join(types)})"]

    def function(self, function, library):
        types = ", ".join(self.ctype(p.type, p.length) for p in function.parameters)
        names = " ".join(p.name for p in function.parameters)
        return [f'{function.name} = function("{library}", "{function.name}", {self.ctype(function.result)}, [{types}], "{names}",',
                quoted(function.doc, "    "), ")"]

    def api(self, library, imports):
        parts = [f'"""The C API of lib{library}, by ctypes: names and arguments are those of its header. Made by '
                 'cmake/python_api.py."""', "", "import ctypes", "",
                 "from ._library import Struct, function", *imports]
        if self.header.version:
            parts += ["", f"VERSION = ({', '.join(self.header.version)})"]
        for one in self.header.declarations:
            parts += ["", ""]
            if isinstance(one, c_header.Enum):
                parts += self.constants(one)
            elif isinstance(one, c_header.Struct):
                parts += self.struct(one)
            elif isinstance(one, c_header.Handle):
                parts += [f"class {one.name}(ctypes.Structure):", quoted(one.doc, "    ")]
            elif one.name in self.callbacks:
                parts += self.callback(one)
            else:
                parts += self.function(one, library)
        return parts

    def stubs(self, imports):
        parts = ["# Made by cmake/python_api.py.", "import ctypes", "from typing import Any, Tuple", "",
                 "from ._library import Struct as Struct", *imports]
        if self.header.version:
            parts.append("VERSION: Tuple[int, int]")
        for one in self.header.declarations:
            if isinstance(one, c_header.Enum):
                parts += self.constants(one)
            elif isinstance(one, c_header.Struct):
                parts += [f"class {one.name}(Struct):", *(f"    {m.name}: Any" for m in one.members)]
            elif isinstance(one, c_header.Handle):
                parts.append(f"class {one.name}(ctypes.Structure): ...")
            elif one.name in self.callbacks:
                parts.append(f"{one.name}: Any")
            else:
                names = ", ".join(f"{p.name}: Any" for p in one.parameters)
                result = {"void": "None", "const char*": "bytes", "void*": "int"}.get(one.result, "int")
                parts.append(f"def {one.name}({names}) -> {result}: ...")
        return parts

    # Methods.

    def hint(self, c_type, name, length=None):
        """The type hint of an argument or a result."""
        kind = base(c_type)
        if name in COUNTS and "*" in c_type:
            return "Any" if kind in SCALARS and kind != "char" else f"Iterable[{'PathLike' if kind == 'char' else 'Mapping[str, Any]'}]"
        if length:
            return "Matrix" if length == "16" else f"SequenceOf[{'float' if kind in ('double', 'float') else 'int'}]"
        if kind in self.enums:
            return f"api.{camel(kind)} | str"
        if kind == "char":
            return "PathLike" if name in PATHS else "str"
        if kind in self.handles:
            return f"objects.{camel(kind)}"
        if kind in self.structs:
            return "Mapping[str, Any]"
        if kind in self.callbacks:
            return "Callable[..., Any]"
        if kind in ("double", "float"):
            return "float"
        return "bool" if kind == "int32_t" and name not in NUMBERS else "int"

    def is_descriptor(self, name):
        """Whether keyword arguments can fill a struct."""
        return name in self.structs and all(self.is_value(m) for m in self.structs[name].members)

    def is_value(self, member):
        kind, stars = base(member.type), member.type.count("*")
        if kind in self.structs:
            return self.is_descriptor(kind)
        return member.name in COUNTS or not stars or kind in ("char", "void") or kind in self.handles

    def is_array(self, struct, member):
        return member.name in COUNTS and any(m.name == COUNTS[member.name][0] for m in struct.members)

    def fields(self, name):
        """The members of a struct that are keyword arguments: no counts of arrays, no arguments of callbacks."""
        struct = self.structs[name]
        counts = {COUNTS[m.name][0] for m in struct.members if self.is_array(struct, m)}
        return [m for m in struct.members if m.name not in counts and m.name != "struct_size"
                and not m.name.endswith(("_user", "release"))]

    def named_tuple(self, name):
        lines = [f"class {camel(name)}(NamedTuple):", quoted(self.structs[name].doc or camel(name), "    "), ""]
        for m in self.fields(name):
            kind = base(m.type)
            if kind == "char":
                hint = "str"
            elif m.length:
                hint = f"Tuple[{'float' if kind in ('double', 'float') else 'int'}, ...]"
            elif kind in self.enums:
                hint = f"api.{camel(kind)}"
            else:
                hint = self.hint(m.type, m.name)
            lines += [f"    #: {line}" for line in m.doc.split("\n") if line]
            lines.append(f"    {m.name}: {hint}")
        return lines

    def argument(self, p):
        """(signature, expression) of an argument that is no descriptor, or None if it is neither."""
        kind, stars, constant = base(p.type), p.type.count("*"), p.type.startswith("const")
        hint = "int" if p.type == "int32_t" else self.hint(p.type, p.name, p.length)
        if p.length and constant:
            return f"{p.name}: {hint}", f'_support.numbers(ctypes.{SCALARS[kind]}, {p.length}, {p.name}, "{p.name}")'
        if not stars and not p.length and kind in self.enums:
            return f"{p.name}: {hint}", f'_support.enum_of(api.{camel(kind)}, {p.name}, "{p.name}")'
        if not stars and not p.length and kind in SCALARS:
            return f"{p.name}: {hint}", p.name
        if kind == "char" and constant and stars == 1:
            default = "" if p.name == "path" else " | None = None"
            return f"{p.name}: {hint}{default}", f"_support.text({p.name})"
        if kind in self.handles and stars == 1:
            return f"{p.name}: {hint} | None", f'_support.pointer_of({p.name}, "{camel(kind)}", "{p.name}")'
        return None

    def result(self, p):
        """(declaration, argument, returned expression) of a parameter that receives a result, or None."""
        kind, stars = base(p.type), p.type.count("*")
        if p.type.startswith("const"):
            return None
        if p.length and kind in SCALARS:
            return f"(ctypes.{SCALARS[kind]} * {p.length})()", p.name, f"tuple({p.name})"
        if stars == 2 and kind in self.handles:
            return f"ctypes.POINTER(api.{kind})()", f"ctypes.byref({p.name})", f'_support.wrap("{camel(kind)}", {p.name})'
        if stars == 1 and kind in self.structs:
            return f"api.{kind}()", f"ctypes.byref({p.name})", f"_support.unpack({camel(kind)}, {p.name})"
        if stars == 1 and kind in SCALARS and kind not in ("char", "float", "uint8_t", "size_t"):
            value = f"bool({p.name}.value)" if kind == "int32_t" else f"{p.name}.value"
            return f"ctypes.{SCALARS[kind]}()", f"ctypes.byref({p.name})", value
        return None

    def array_arguments(self, function):
        """{parameter: (signature, expression)} of parameters that are arrays. The parameter with their length has no
        signature."""
        found = {}
        counted = any(p.name == "count" for p in function.parameters) and function.name not in READS
        for p in function.parameters:
            kind = base(p.type)
            if not p.type.startswith("const") or not p.type.endswith("*"):
                continue
            if p.name == "bytes":
                found[p.name] = "bytes: Any", '*_support.bytes_of(bytes, "bytes")'
            elif kind == "double" and counted:
                found[p.name] = f"{p.name}: Iterable[Matrix]", f'_support.groups(ctypes.c_double, 16, {p.name}, "{p.name}")'
            elif kind == "double":
                hint, convert = ("Matrix", "matrix") if p.name == "to_world" else ("float", "seconds")
                found[p.name] = f"{p.name}: {hint} | None = None", f'_support.{convert}({p.name}, "{p.name}")'
            elif kind == "float" and p.name == "points":
                found[p.name] = f"{p.name}: Iterable[Tuple[float, float]]", f'_support.groups(ctypes.c_float, 2, {p.name}, "{p.name}")'
            elif kind == "float" and p.name == "stops":
                hint = "Iterable[Tuple[float, float, float, float]]"
                found[p.name] = f"{p.name}: {hint}", f'_support.groups(ctypes.c_float, 4, {p.name}, "{p.name}")'
            elif counted and self.is_descriptor(kind):
                found[p.name] = (f"{p.name}: Iterable[Mapping[str, Any]]",
                                 f'_support.structs(api.{kind}, {p.name}, "{p.name}")')
        if counted and found:
            found["count"] = None, f"_support.length_of({', '.join(name for name in found)})"
        elif "bytes" in found:
            found["size"] = None, None
        return found

    def plan(self, function):
        """The parts of a method: arguments, descriptor, setup, values, results. None if it must be written by hand."""
        parts = {"signature": [], "descriptor": None, "setup": [], "values": [], "results": [], "pairs": []}
        arrays = self.array_arguments(function)
        described = [p for p in function.parameters
                     if p.type.startswith("const") and self.is_descriptor(base(p.type)) and p.name not in arrays]
        reads = function.name in READS
        for p in function.parameters:
            if p.name in ("error", "error_size") or (reads and p.name in ("rgba", "rgb", "values", "count")):
                continue
            if p.name in arrays:
                signature, value = arrays[p.name]
                parts["signature"] += [signature] if signature else []
                parts["values"] += [value] if value else []
                continue
            argument, result = self.argument(p), self.result(p)
            if p in described and p.type.count("*") == 1:
                if len(described) == 1:
                    parts["descriptor"] = base(p.type)
                    parts["values"].append(f"_support.fill(api.{base(p.type)}, locals())")
                else:
                    parts["signature"].append(f"{p.name}: Mapping[str, Any]")
                    parts["values"].append(f"_support.fill(api.{base(p.type)}, {p.name})")
            elif argument:
                parts["signature"].append(argument[0])
                parts["values"].append(argument[1])
            elif result:
                parts["setup"].append(f"{p.name} = {result[0]}")
                parts["values"].append(result[1])
                parts["results"].append(result[2])
                parts["pairs"].append(p)
            else:
                return None
        return parts

    def result_hint(self, p):
        kind = base(p.type)
        if p.length:
            return "Tuple[float, ...]" if kind in ("double", "float") else "Tuple[int, ...]"
        if kind in self.structs:
            return camel(kind)
        return f"objects.{camel(kind)} | None" if kind in self.handles else self.hint(p.type, p.name)

    def method_doc(self, function, plan):
        text, tagged, result = c_header.sections(function.doc)
        names = [part.split(":")[0] for part in plan["signature"]]
        lines = [f"{name}: {tagged[name]}" for name in names if tagged.get(name)]
        if plan["descriptor"]:
            lines += [f"{m.name}: {m.doc}" for m in self.fields(plan["descriptor"]) if m.doc]
        return "\n\n".join(part for part in (text, *lines, f"C: {function.name}. {result}") if part)

    def method(self, function, name, plan):
        creates = function.name in CREATE
        keywords = self.fields(plan["descriptor"]) if plan["descriptor"] else []
        signature = ["cls" if creates and name != "__init__" else "self", *plan["signature"]]
        signature += [f"{m.name}: {self.hint(m.type, m.name)}" for m in keywords if m.name in ("path", "paths")]
        keywords = [m for m in keywords if m.name not in ("path", "paths")]
        if keywords:
            signature += ["*", *(f"{m.name}: {self.hint(m.type, m.name, m.length)} | None = None" for m in keywords)]
        hints = [self.result_hint(p) for p in plan["pairs"]]
        returned = "None" if not hints else hints[0] if len(hints) == 1 else f"Tuple[{', '.join(hints)}]"
        if creates:
            returned = "None" if name == "__init__" else f"objects.{camel(base(plan['pairs'][0].type))}"
        elif function.name in READS:
            returned = "memoryview"
        elif function.result == "const char*":
            returned = "str"
        elif function.result not in ("void", "cumulet_status"):
            returned = "int"
        lines = ["    @classmethod"] if signature[0] == "cls" else []
        lines += [f"    def {name}({', '.join(signature)}) -> {returned}:", quoted(self.method_doc(function, plan), INDENT)]
        values = list(plan["values"])
        for i, value in enumerate(values):  # locals() must not have the results
            if "locals()" in value:
                lines.append(f"{INDENT}described = {value}")
                values[i] = "described"
        lines += [f"{INDENT}{line}" for line in plan["setup"]]
        arguments = ", ".join([f"api.{function.name}", *values])
        if creates:
            lines.append(f"{INDENT}_support.call({arguments})")
            lines.append(f"{INDENT}self._adopt(out)" if name == "__init__" else f"{INDENT}return {plan['results'][0]}")
            return lines
        if function.name in READS:
            return [*lines, f"{INDENT}return self._read({', '.join([f'api.{function.name}', READS[function.name], *values])})"]
        call = "_call_any_time" if ANY_TIME in function.doc else "_call_gl" if function.doc.startswith("[GL]") else "_call"
        if function.result == "const char*":
            lines.append(f'{INDENT}return self.{call}({arguments}).decode("utf-8")')
        elif plan["results"]:
            lines += [f"{INDENT}self.{call}({arguments})", f"{INDENT}return {', '.join(plan['results'])}"]
        else:
            lines.append(f"{INDENT}self.{call}({arguments})")
        return lines

    def methods(self, api):
        classes = {handle: [] for handle in self.handles if handle in {h.name for h in self.header.of(c_header.Handle)}}
        filled = {base(p.type): None for f in self.functions for p in f.parameters
                  if base(p.type) in self.structs and p.type.count("*") == 1 and not p.type.startswith("const")}
        for function in self.functions:
            owner = base(function.parameters[0].type) if function.parameters else None
            name = CREATE.get(function.name)
            if name:
                owner = next(base(p.type) for p in function.parameters if p.type.endswith("**"))
            if owner not in classes or OTHERWISE.search(function.name):
                continue
            own = function if name else function._replace(parameters=function.parameters[1:])
            plan = self.plan(own)
            if plan is None:
                continue
            name = name or RENAMED.get(function.name)
            name = name or function.name.removeprefix(owner + "_").removeprefix("cumulet_")
            classes[owner] += [*self.method(own, name, plan), ""]
        parts = ['"""Methods that follow from the C API. Made by cmake/python_api.py."""', "",
                 "from __future__ import annotations", "", "import ctypes",
                 "from typing import TYPE_CHECKING, Any, Callable, Iterable, Mapping, NamedTuple, Tuple",
                 "from typing import Sequence as SequenceOf", "",
                 f"from . import _support, {api} as api" if api != "api" else "from . import _support, api",
                 "from ._support import Matrix, PathLike", "", "if TYPE_CHECKING:", "    from . import objects"]
        for name in filled:
            parts += ["", "", *self.named_tuple(name)]
        for owner, lines in classes.items():
            doc = quoted(self.handles[owner].doc, "    ")
            end = next((f.name for f in self.functions if re.fullmatch(owner + "_(?:release|destroy)", f.name)), None)
            lines = [f"    _end = api.{end}", "", *lines] if end else lines
            if any("self._read(" in line for line in lines):
                lines = ["    _read: Callable[..., memoryview]", "", *lines]
            name = camel(owner) if owner in WHOLE else f"{camel(owner)}Methods"
            parts += ["", "", f"class {name}(_support.Handle):", doc, "", *lines]
        return parts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("header")
    parser.add_argument("--types", nargs="*", default=[], metavar="HEADER", help="headers that it includes")
    parser.add_argument("--library", required=True, help="the library's name without lib and .so")
    parser.add_argument("--enums", required=True)
    parser.add_argument("--api", required=True)
    parser.add_argument("--stubs", required=True)
    parser.add_argument("--methods", required=True)
    arguments = parser.parse_args()
    generator = Generator(arguments.header, arguments.types)
    module, enums = (re.search(r"(\w+)\.py$", path)[1] for path in (arguments.api, arguments.enums))
    imports = [f"from .{enums} import *", *(["from .api import *"] if arguments.types else [])]
    for path, parts in ((arguments.enums, generator.enum_module()),
                        (arguments.api, generator.api(arguments.library, imports)),
                        (arguments.stubs, generator.stubs(imports)),
                        (arguments.methods, generator.methods(module))):
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join(parts).rstrip() + "\n")


if __name__ == "__main__":
    main()
