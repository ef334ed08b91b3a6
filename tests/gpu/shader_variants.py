"""Writes folders of shaders for `cumulet-render --shaders`: copies of glsl/ with changes.

    shader_variants.py GLSL BENCH OUT

OUT/paper_rules: our kernel with the path rules of the paper. OUT/paper_kernel: the kernel of the paper, from the folder
BENCH/paper. OUT/two_paths: twice as many paths as lanes, from BENCH/two_paths. BENCH is tests/bench. Fails if a text to
be replaced is missing or not unique.
"""
import pathlib
import shutil
import sys

# The Russian roulette ends paths with probability 1 - w, and does not divide by w.
PAPER_RULES = [
    ("path/path.glsl",
     "float survival = strongest < 0.5f && !(grounded && p.bounces == 1u) ? max(strongest, 0.05f) : 1.0f;",
     "float survival = min(strongest, 1.0f);"),
    ("path/path.glsl", "  p.throughput = p.throughput / survival;\n", ""),
]

# Other variants keep the kernel as it is. Emission is summed up in chunks of 8 cells, and is excluded.
TWO_PATHS = [
    ("path/trace.comp", "layout(local_size_x = 8, local_size_y = 8) in;\n", ""),
    ("path/trace.comp", '#include "common/parameters.glsl"\n', """#include "common/parameters.glsl"
#define CM_TWO_PATHS (CM_MARCH == 0 && !CM_INSTANCES && !CM_CHANNELS && !CM_GROUPS && !CM_MOTION && !CM_EQUIANGULAR)
#if CM_TWO_PATHS
layout(local_size_x = 8, local_size_y = 4) in;
#define CM_CHUNK 4
#else
layout(local_size_x = 8, local_size_y = 8) in;
#endif
"""),
    ("path/path_store.glsl", "buffer CmPaths {", "coherent buffer CmPaths {"),
    ("path/trace.comp", "void main() {\n", """#if CM_TWO_PATHS
#include "path/two_paths.glsl"
void main() { cm_two_paths(); }
#else
void main() {
"""),
    ("path/trace.comp", "  if (gl_LocalInvocationIndex == 0u) atomicAdd(cm_running.x, 0xffffffffu);\n}\n",
     "  if (gl_LocalInvocationIndex == 0u) atomicAdd(cm_running.x, 0xffffffffu);\n}\n#endif\n"),
]
# Per folder: the changed texts, and a folder of files to add or replace.
VARIANTS = {
    "paper_rules": (PAPER_RULES, None),
    "paper_kernel": ([], "paper"),
    "two_paths": (TWO_PATHS, "two_paths"),
}


def main(glsl, bench, out):
    for variant, (edits, added) in VARIANTS.items():
        shutil.rmtree(out / variant, ignore_errors=True)
        shutil.copytree(glsl, out / variant)
        if added:
            shutil.copytree(bench / added, out / variant, dirs_exist_ok=True)
        for name, old, new in edits:
            path = out / variant / name
            text = path.read_text()
            if text.count(old) != 1:
                sys.exit(f"{name}: is not once there: {old}")
            path.write_text(text.replace(old, new))


main(*map(pathlib.Path, sys.argv[1:4]))
