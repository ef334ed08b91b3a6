"""Validate the shaders of glsl/ with glslangValidator. By default it validates a subset of the variants (listed by
embed_glsl.py): every combination of three macros' values occurs in it, and it is a twelfth of all. --all validates
each.

A range counts as all its values. A range of more than eight values counts as its two ends; the values between are
assumed to compile as the ends do.
"""
import argparse
import heapq
import itertools
import pathlib
import re
import subprocess
import sys
import tempfile

import embed_glsl

TOGETHER = 3  # macros whose combinations are covered
AT_ONCE = 64  # files per call of the validator


def all_defines(variants):
    """Returns one dict macro -> value for each variant and each choice of values."""
    found = []
    for macros in variants:
        names = [name for name, _, _ in macros]
        choices = [values[::len(values) - 1] if is_range and len(values) > 8 else values for _, values, is_range in macros]
        found += [dict(zip(names, chosen)) for chosen in itertools.product(*choices)]
    return found


def covering(defines):
    """Returns a subset that covers every combination of TOGETHER macros' values in the input. An absent macro counts as
    a value. Greedy: each step takes the variant with the most new combinations."""
    names = sorted({name for some in defines for name in some})
    held = [set(itertools.combinations([(name, some.get(name)) for name in names], min(TOGETHER, len(names))))
            for some in defines]
    queue = [(-len(combinations), i) for i, combinations in enumerate(held)]
    heapq.heapify(queue)
    covered, chosen = set(), []
    while queue:
        _, i = heapq.heappop(queue)
        new = len(held[i] - covered)
        if new and queue and -new > queue[0][0]:
            heapq.heappush(queue, (-new, i))
        elif new or not chosen:
            covered |= held[i]
            chosen.append(i)
    return [defines[i] for i in sorted(chosen)]


def with_defines(source, defines):
    version, rest = source.split("\n", 1)
    lines = "".join(f"#define {name} {value}\n" for name, value in defines.items())
    return f"{version}\n{lines}{rest}"


def validate(validator, folder, path, source, variants):
    files = {}
    for i, defines in enumerate(variants):
        file = folder / f"{path.stem}_{i}{path.suffix}"
        file.write_text(with_defines(source, defines))
        files[file] = defines
    names = list(files)
    for i in range(0, len(names), AT_ONCE):
        if subprocess.run([validator, "-t", *names[i:i + AT_ONCE]], capture_output=True).returncode == 0:
            continue
        for file in names[i:i + AT_ONCE]:  # validates one file at a time to find the one that fails
            result = subprocess.run([validator, file], capture_output=True, text=True)
            if result.returncode != 0:
                macros = ", ".join(f"{name}={value}" for name, value in files[file].items())
                sys.exit(f"{path.name} [{macros}]:\n{result.stdout}{result.stderr}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--validator", required=True)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--stamp", type=pathlib.Path, help="written when all are valid")
    options = parser.parse_args()
    count = 0
    for path, source in embed_glsl.shaders_of(options.folder):
        variants = all_defines(embed_glsl.variants_of(path.name, source)) or [{}]
        if not options.all:
            variants = covering(variants)
        with tempfile.TemporaryDirectory() as folder:
            validate(options.validator, pathlib.Path(folder), path, source, variants)
        count += len(variants)
    print(f"{count} variants are valid")
    if options.stamp:
        options.stamp.touch()


if __name__ == "__main__":
    main()
