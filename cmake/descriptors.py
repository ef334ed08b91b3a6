"""Writes the part of cumulet.hpp that is derived from cumulet.h: enum classes, descriptors that convert to the C
structs, and structs that are filled from C.

A descriptor here is a struct of settings, of a frame or of a file: numbers, enums, strings and arrays of numbers. Its
int32_t members are booleans. Names, order and meaning are those of the header.
"""
import argparse
import re

import c_header

DESCRIPTORS = ["grid", "medium", "sun_sky", "light", "environment_settings", "ground", "surface_settings", "sampling",
               "display", "camera", "navigation", "frame", "transmittance_map", "volume_file", "denoise", "playback",
               "dynamic_volume", "limits", "read"]
# Descriptors that C functions also fill.
FILLED = {"camera"}
# Structs that only C functions fill.
TOLD = ["volume_info", "histogram_info", "volume_file_info", "grid_info", "metadata", "surfaces_info", "animation_info",
        "variant_info", "environment_info", "progress", "warm_up_result", "pick", "transmittance_map", "sequence_info",
        "dynamic_volume_info", "stats", "read_info"]
COUNTED = {"default_grid"}  # int32_t members that are numbers or -1, not booleans
ENUMS_BY_HAND = {"cumulet_status", "cumulet_key"}
RENAMED = {"auto": "automatic"}  # a C++ keyword

NUMBERS = {"double": ("double", "0.0"), "float": ("float", "0.0F"), "uint32_t": ("std::uint32_t", "0"),
           "uint64_t": ("std::uint64_t", "0")}
ARRAYS = {("float", 3): "Rgb", ("double", 3): "Vector", ("double", 16): "Matrix"}


def camel(name):
    if name == "cumulet_status":
        return "StatusCode"
    return "".join(part.capitalize() for part in name.removeprefix("cumulet_").split("_"))


def enum_class(name, body):
    constants = re.findall(r"(CUMULET_\w+)\s*=", body)
    prefix = c_header.common_prefix(constants)
    values = []
    for constant in constants:
        value = constant.removeprefix(prefix).lower()
        values.append(f"  {RENAMED.get(value, value)} = {constant}")
    return f"enum class {camel(name)} {{\n" + ",\n".join(values) + "\n};\n"


def fields(body):
    """Yields type, name and array length (None: no array) of each field."""
    for declaration in body.split(";"):
        match = re.fullmatch(r"\s*(const char\*|void\*|\w+)\s+(\w+)(?:\[(\w+)\])?\s*", declaration)
        if match and match[2] != "struct_size":
            length = match[3]
            yield match[1], match[2], int(length) if length and length.isdigit() else length


def member(c_type, name, length):
    """Returns the C++ declaration, the expression that converts it to C and the expression that converts it from C."""
    if c_type == "char":
        return f"Text<{length}> {name};", None, f"Text<{length}>(c.{name})"
    if length:
        cpp = ARRAYS.get((c_type, length), f"std::array<{NUMBERS.get(c_type, ('std::' + c_type,))[0]}, {length}>")
        elements = ", ".join(f"{name}[{i}]" for i in range(length)) if isinstance(length, int) else None
        return f"{cpp} {name}{{}};", f"{{{elements}}}", f"std::to_array(c.{name})"
    if c_type in ("const char*", "void*") or c_type.endswith("_fn"):
        return f"{c_type} {name} = nullptr;", name, None
    if c_type in NUMBERS:
        cpp, zero = NUMBERS[c_type]
        return f"{cpp} {name} = {zero};", name, f"c.{name}"
    if c_type == "int32_t":
        return f"bool {name} = false;", f"{name} ? 1 : 0", f"c.{name} != 0"
    return f"{camel(c_type)} {name}{{}};", f"static_cast<{c_type}>({name})", f"static_cast<{camel(c_type)}>(c.{name})"


def told(name, body):
    """Returns a struct that C fills and its conversion from C. Strings are valid as long as the C header says."""
    members = []
    for c_type, field, length in fields(body):
        declaration, _, of = member(c_type, field, length)
        if field == "bounds_min":
            field, declaration = "bounds", "Bounds bounds;"
            of = "{std::to_array(c.bounds_min), std::to_array(c.bounds_max)}"
        elif field == "bounds_max":
            continue
        elif c_type == "const char*":
            declaration, of = f"std::string_view {field};", f'c.{field} != nullptr ? c.{field} : ""'
        elif field in COUNTED:
            declaration, of = f"std::int32_t {field} = -1;", f"c.{field}"
        members.append((field, declaration, of))
    lines = [f"struct {camel(name)} {{"]
    lines += [f"  {declaration}" for _, declaration, _ in members]
    values = ",\n            ".join(f".{field} = {of}" for field, _, of in members)
    lines += ["", f"  [[nodiscard]] static {camel(name)} of(const {name}& c) noexcept {{", f"    return {{{values}}};", "  }"]
    return "\n".join(lines + ["};"]) + "\n"


def descriptor(name, body, filled):
    members = [(field, *member(c_type, field, length)) for c_type, field, length in fields(body)]
    lines = [f"struct {camel(name)} {{"]
    lines += [f"  {declaration}" for _, declaration, _, _ in members]
    lines += ["", f"  operator {name}() const noexcept {{", f"    return {{.struct_size = sizeof({name}),"]
    lines += [f"            .{field} = {to}," for field, _, to, _ in members]
    lines[-1] = lines[-1][:-1] + "};"
    lines += ["  }"]
    if filled:
        values = ",\n            ".join(f".{field} = {of}" for field, _, _, of in members)
        lines += [f"  [[nodiscard]] static {camel(name)} of(const {name}& c) noexcept {{", f"    return {{{values}}};", "  }"]
    return "\n".join(lines + ["};"]) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", required=True)
    parser.add_argument("header")
    arguments = parser.parse_args()
    text = c_header.read(arguments.header)
    version = [re.search(rf"CUMULET_VERSION_{part} (\d+)", text)[1] for part in ("MAJOR", "MINOR")]
    enums = c_header.types("enum", text)
    structs = dict(c_header.types("struct", text))
    parts = ["/*\n * The part of cumulet.hpp that follows from cumulet.h: include that. Made by cmake/descriptors.py.\n */",
             "#ifndef CUMULET_CUMULET_DESCRIPTORS_HPP\n#define CUMULET_CUMULET_DESCRIPTORS_HPP\n",
             "#include <cumulet/cumulet.h>\n\n#include <array>\n#include <cstdint>\n#include <string_view>\n",
             f"namespace cumulet {{\ninline namespace v{version[0]}_{version[1]} {{\n"]
    parts += [enum_class(name, body) for name, body in enums if name not in ENUMS_BY_HAND]
    parts += [descriptor(f"cumulet_{name}_desc", structs[f"cumulet_{name}_desc"], name in FILLED) for name in DESCRIPTORS]
    parts += [told(f"cumulet_{name}", structs[f"cumulet_{name}"]) for name in TOLD]
    parts += ["}\n}\n\n#endif"]
    with open(arguments.out, "w", encoding="utf-8") as file:
        file.write("\n".join(parts) + "\n")


if __name__ == "__main__":
    main()
