"""Resolve #include "x.glsl" in glsl/, validate each shader, and write one C++ file that holds them all.

A shader declares the variants that the library compiles in comments: `// variant: CM_MARCH=1 CM_CELLS=0`.
Each is validated with glslangValidator where there is one.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')


def flatten(path, seen):
    lines = []
    for line in path.read_text().splitlines():
        match = INCLUDE.match(line)
        if not match:
            lines.append(line)
            continue
        included = path.parent / match.group(1)
        if included not in seen:
            seen.add(included)
            lines += flatten(included, seen)
    return lines


def with_defines(source, defines):
    version, rest = source.split("\n", 1)
    lines = "".join(f"#define {d.replace('=', ' ')}\n" for d in defines)
    return f"{version}\n{lines}{rest}"


def validate(validator, name, source):
    variants = re.findall(r"^// variant:(.*)$", source, re.M) or [""]
    for variant in variants:
        with tempfile.NamedTemporaryFile("w", suffix=pathlib.Path(name).suffix) as file:
            file.write(with_defines(source, variant.split()))
            file.flush()
            result = subprocess.run([validator, file.name], capture_output=True, text=True)
        if result.returncode != 0:
            sys.exit(f"{name} [{variant.strip()}]:\n{result.stdout}{result.stderr}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--validator", default="")
    options = parser.parse_args()

    shaders = sorted(p for p in options.folder.iterdir() if p.suffix in (".comp", ".vert", ".frag"))
    parts = ['#include "gl/shader_sources.hpp"\n\nnamespace cumulet::gl {\n']
    cases = []
    for path in shaders:
        source = "\n".join(flatten(path, set())) + "\n"
        if options.validator and not options.validator.endswith("NOTFOUND"):
            validate(options.validator, path.name, source)
        symbol = path.name.replace(".", "_")
        # Compilers limit the length of one literal; adjacent ones join.
        chunks = [source[i:i + 8000] for i in range(0, len(source), 8000)]
        literal = "\n".join(f'R"glsl({chunk})glsl"' for chunk in chunks)
        parts.append(f"static constexpr char {symbol}[] =\n{literal};\n")
        cases.append(f'  if (name == "{path.name}") return {symbol};\n')
    parts.append("std::string_view shader_source([[maybe_unused]] std::string_view name) {\n" + "".join(cases) + "  return {};\n}\n")
    parts.append("}  // namespace cumulet::gl\n")
    options.out.write_text("\n".join(parts))


if __name__ == "__main__":
    main()
