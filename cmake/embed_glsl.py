"""Resolve #include "folder/x.glsl" (relative to glsl/) in the shaders of glsl/, and write one C++ file that holds all shaders, and a header that names the macros
of their variants.

A shader that is compiled with macros lists them in comments; gl::Programs builds only these variants:

    // variants: CM_STAGE=0 CM_USED=1..8 or CM_STAGE=1,2
    // variants: - or CM_LAYERS=1

A line holds alternatives, and every variant has exactly one of them; "-" means none of the macros. 1,2 are values; 1..8
is a range of values. The variants are the product of the lines; cmake/validate_glsl.py validates them. A combination of
macros that no picture needs is left out of the product:

    // excluded: CM_LAYERS=1 CM_AOVS=1 or CM_LAYERS=1 CM_GROUPS=1

Shaders share alternatives by a list with a name. "..." marks the position of the macros that a use adds:

    // variants of VOLUMES: CM_MARCH=0 ... CM_WIDE=1 or CM_MARCH=1 ...
    // variants: VOLUMES or VOLUMES CM_MOTION=1
"""
import argparse
import itertools
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
MACRO = re.compile(r"(CM_[A-Z_]+)=(?:(\d+)\.\.(\d+)|(\w+(?:,\w+)*))")


def flatten(root, path, seen):
    lines = []
    for line in path.read_text().splitlines():
        match = INCLUDE.match(line)
        if not match:
            lines.append(line)
            continue
        included = root / match.group(1)
        if included not in seen:
            seen.add(included)
            lines += flatten(root, included, seen)
    return lines


def shaders_of(folder):
    """Yields the path and the whole source of each shader."""
    shaders = [path for path in folder.rglob("*") if path.suffix in (".comp", ".vert", ".frag")]
    for path in sorted(shaders, key=lambda path: path.name):
        yield path, "\n".join(flatten(folder, path, set())) + "\n"


def parse_macro(text, where):
    match = MACRO.fullmatch(text)
    if not match:
        sys.exit(f"{where}: '{text}' is no NAME=VALUE,... or NAME=LOW..HIGH")
    name, low, high, values = match.groups()
    if values:
        return name, values.split(","), False
    return name, [str(i) for i in range(int(low), int(high) + 1)], True


def with_lists(line, lists):
    """Returns the alternatives of a line, each a list of words; names of lists are replaced by their alternatives."""
    found = []
    for words in (part.split() for part in line.split(" or ")):
        if words[0] not in lists:
            found.append(words)
            continue
        for listed in (part.split() for part in lists[words[0]].split(" or ")):
            at = listed.index("...") if "..." in listed else len(listed)
            found.append(listed[:at] + words[1:] + listed[at + 1:])
    return found


def variants_of(name, source):
    """Returns the variants. Each is a list of macros (name, values, whether they are a range)."""
    if re.search(r"^// variant:", source, re.M):
        sys.exit(f"{name}: '// variant:' lines are not read any more: see cmake/embed_glsl.py for '// variants:'")
    lists = dict(re.findall(r"^// variants of ([A-Z_]+):(.*)$", source, re.M))
    lines = []
    for line in re.findall(r"^// variants:(.*)$", source, re.M):
        lines.append([[parse_macro(m, name) for m in part if m != "-"] for part in with_lists(line, lists)])
    excluded = [dict(parse_macro(m, name)[:2] for m in part.split())
                for line in re.findall(r"^// excluded:(.*)$", source, re.M) for part in line.split(" or ")]
    variants = [sum(choice, []) for choice in itertools.product(*lines)]
    for macros in excluded:
        kept = [variant for variant in variants if not has_all(variant, macros)]
        if len(kept) == len(variants):
            sys.exit(f"{name}: no variant has the excluded macros {' '.join(macros)}")
        variants = kept
    return variants


def has_all(variant, macros):
    """Returns whether a variant has each of these macros (name -> values) with just these values."""
    mine = {macro: values for macro, values, _ in variant}
    return all(mine.get(macro) == values for macro, values in macros.items())


def variant_tables(symbol, variants):
    """Returns the C++ text of the shader's variants, as gl/shader_sources.hpp declares them."""
    rows, uses = [], []
    for i, macros in enumerate(variants):
        entries = []
        for j, (macro, values, is_range) in enumerate(macros):
            texts = ", ".join(f'"{v}"' for v in values)
            rows.append(f"static constexpr std::string_view {symbol}_{i}_{j}[] = {{{texts}}};")
            entries.append(f'{{"{macro}", {symbol}_{i}_{j}, {"true" if is_range else "false"}}}')
        if entries:
            rows.append(f"static constexpr ShaderMacro {symbol}_{i}[] = {{{', '.join(entries)}}};")
        uses.append(f"{symbol}_{i}" if entries else "std::span<const ShaderMacro>{}")
    rows.append(f"static constexpr std::span<const ShaderMacro> {symbol}_variants[] = {{{', '.join(uses)}}};\n")
    return "\n".join(rows)


def macros_header(names):
    """Returns a C++ header with a constant for each macro: gl::macros::halves is CM_HALVES."""
    lines = ["// Made by cmake/embed_glsl.py.", "#pragma once", "", '#include "gl/macro_name.hpp"', "",
             "namespace cumulet::gl::macros {"]
    lines += [f'inline constexpr MacroName {name.removeprefix("CM_").lower()}("{name}");' for name in sorted(names)]
    return "\n".join(lines + ["}  // namespace cumulet::gl::macros", ""])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--macros", type=pathlib.Path, required=True)
    options = parser.parse_args()

    parts = ['#include "gl/shader_sources.hpp"\n\nnamespace cumulet::gl {\n']
    entries = []
    macros = set()
    for path, source in shaders_of(options.folder):
        if number := re.search(r"binding\s*=\s*\d.*", source):
            sys.exit(f"{path.name}: '{number.group()}' is no name of glsl/common/bindings.glsl")
        variants = variants_of(path.name, source)
        macros.update(name for variant in variants for name, _, _ in variant)
        symbol = path.name.replace(".", "_")
        # Compilers limit the length of one string literal; adjacent literals are concatenated.
        chunks = [source[i:i + 8000] for i in range(0, len(source), 8000)]
        literal = "\n".join(f'R"glsl({chunk})glsl"' for chunk in chunks)
        file = path.relative_to(options.folder).as_posix()
        parts.append(f"static constexpr char {symbol}[] =\n{literal};\n")
        parts.append(variant_tables(symbol, variants))
        # The size is stored too, because clang refuses to compute it in a constant this large.
        entries.append(f'    {{"{path.name}", "{file}", {{{symbol}, sizeof({symbol}) - 1}}, {symbol}_variants}},')
    parts.append("static constexpr Shader all_shaders[] = {\n" + "\n".join(entries) + "\n};\n")
    parts.append("std::span<const Shader> shaders() { return all_shaders; }\n")
    parts.append("}  // namespace cumulet::gl\n")
    options.out.write_text("\n".join(parts))
    header = macros_header(macros)
    # An unchanged header is not written, so that files that include it are not compiled again.
    if not options.macros.exists() or options.macros.read_text() != header:
        options.macros.write_text(header)


if __name__ == "__main__":
    main()
