"""Writes the end offsets of the fields of cumulet.h's structs, as C++: the sizes that a host's struct_size may have.

This script reads only the names. The compiler fills in the numbers, and c_support.hpp asserts that they leave out no
byte.
"""
import argparse
import re

import c_header


def structs(header):
    for name, body in c_header.types("struct", header):
        fields = [re.search(r"(\w+)\s*(\[[^\]]*\]\s*)*$", d.strip()).group(1) for d in body.split(";") if d.strip()]
        if fields[0] == "struct_size":
            yield name, fields


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", required=True)
    parser.add_argument("header")
    arguments = parser.parse_args()
    found = list(structs(c_header.read(arguments.header)))
    lines = ["// Made by cmake/struct_fields.py."]
    for name, fields in found:
        lines.append(f"template <>\ninline constexpr auto fields_of<{name}> = std::to_array<Field>({{")
        lines += [f"    {{\"{f}\", offsetof({name}, {f}), sizeof({name}::{f}), alignof(decltype({name}::{f}))}}," for f in fields]
        lines.append(f"}});\nstatic_assert(covers<{name}>());")
    with open(arguments.out, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
