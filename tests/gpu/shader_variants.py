"""Writes folders of shaders for `cumulet-render --shaders`: copies of glsl/ with changes.

    shader_variants.py GLSL PAPER OUT

OUT/paper_rules: our kernel with the path rules of the paper. OUT/paper_kernel: the kernel of the paper, from the folder
PAPER (tests/bench/paper). Fails if a text to be replaced is missing or not unique.
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


def main(glsl, paper, out):
    for name in ("paper_rules", "paper_kernel"):
        shutil.rmtree(out / name, ignore_errors=True)
        shutil.copytree(glsl, out / name)
    for name, old, new in PAPER_RULES:
        path = out / "paper_rules" / name
        text = path.read_text()
        if text.count(old) != 1:
            sys.exit(f"{name}: is not once there: {old}")
        path.write_text(text.replace(old, new))
    shutil.copytree(paper, out / "paper_kernel", dirs_exist_ok=True)


main(*map(pathlib.Path, sys.argv[1:4]))
