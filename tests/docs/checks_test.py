"""The checks of this folder report each fault with its line, and accept a good page."""

import os
import pathlib
import stat
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import checkout  # noqa: E402

GOOD = {
    "README.md": "# Title\n\nSee [the guide](docs/guide.md#first-step-2-of-2), [below](#title) and `docs/guide.md`.\n",
    "docs/guide.md": "# Guide\n\n## First step, `2` of 2\n\nSet `size` of `cumulet_thing_desc`. `CUMULET_ONE` is a number.\n\n"
                     "```c\nconst cumulet_thing_desc thing = {.size = CUMULET_ONE};\ncumulet_use(&thing);\n```\n\n"
                     "    # Two commands\n    cumulet-render cloud.vdb --spp 4 \\\n      -o out.png && cumulet-render cloud.vdb -o b.png\n\n"
                     "Use `--spp` and `cumulet-render --spp N FILE`.\n",
    "src/include/cumulet/cumulet.h": "#define CUMULET_ONE 1\ntypedef struct cumulet_thing_desc {\n  uint32_t size; /* in */\n"
                                     "} cumulet_thing_desc;\nvoid cumulet_use(const cumulet_thing_desc* thing);\n",
}
# In place of cumulet-render: without its volume it fails, as that does.
RENDER = f"#!{sys.executable}" + """
import os, sys
words = sys.argv[1:]
if words == ["--help"]:
    print("Options:\\n  -o,--output FILE   Output\\n  --spp N            Samples\\n  --size WxH         Size\\n  -h,--help          Help")
    sys.exit(0)
if "--spp" in words and not words[words.index("--spp") + 1].isdigit():
    print("cumulet-render: --spp: no number", file=sys.stderr)
    sys.exit(2)
if not os.path.exists("cloud.vdb"):
    sys.exit("cumulet-render: cloud.vdb: no such file")
if os.environ.get("WRITES", "1") == "1":
    open(words[words.index("-o") + 1], "w").write(" ".join(words))
"""


class Checks(checkout.Checkout):
    def setUp(self):
        super().setUp()
        self.render = self.folder / "cumulet-render"
        self.render.write_text(RENDER)
        self.render.chmod(self.render.stat().st_mode | stat.S_IXUSR)
        self.write(GOOD)

    def replace(self, name, old, new):
        text = (self.root / name).read_text()
        self.assertIn(old, text)
        (self.root / name).write_text(text.replace(old, new))

    def run_check(self, script, *arguments, **environment):
        done = subprocess.run([sys.executable, "-B", HERE / script, *arguments], capture_output=True, text=True,
                              env={**os.environ, **environment})
        return done.returncode, done.stdout + done.stderr

    def check(self, name):
        return self.run_check(name, self.root, *([self.render] if name == "commands.py" else []))

    def reported(self, name, expected):
        status, output = self.check(name)
        self.assertEqual(status, 1, output)
        self.assertIn(expected, output)

    def test_a_good_page(self):
        for name in ("links.py", "names.py", "commands.py"):
            status, output = self.check(name)
            self.assertEqual(status, 0, output)

    def test_a_checkout_without_pages(self):
        for page in ("README.md", "docs/guide.md"):
            (self.root / page).unlink()
        self.assertEqual(self.check("links.py")[0], 1)

    def test_a_link_to_nothing(self):
        self.replace("README.md", "(docs/guide.md#", "(docs/missing.md#")
        self.reported("links.py", "README.md:3: link to 'docs/missing.md#first-step-2-of-2': there is no 'docs/missing.md'")

    def test_a_link_to_no_heading(self):
        self.replace("README.md", "#first-step-2-of-2", "#second-step")
        self.reported("links.py", "README.md:3: link to 'docs/guide.md#second-step': 'docs/guide.md' has no such heading")

    def test_a_path_to_nothing(self):
        self.replace("README.md", "`docs/guide.md`", "`docs/gone.md`")
        self.reported("links.py", "README.md:3: there is no 'docs/gone.md'")

    def test_an_unknown_name(self):
        self.replace("docs/guide.md", "cumulet_use(", "cumulet_apply(")
        self.reported("names.py", "docs/guide.md:9: the headers have no 'cumulet_apply'")

    def test_an_unknown_field_in_code(self):
        self.replace("docs/guide.md", ".size =", ".width =")
        self.reported("names.py", "docs/guide.md:8: no struct of the headers has 'width'")

    def test_an_unknown_field_in_prose(self):
        self.replace("docs/guide.md", "`size` of", "`width` of")
        self.reported("names.py", "docs/guide.md:5: cumulet_thing_desc has no 'width'")

    def test_a_name_in_a_comment_of_the_header_is_no_name(self):
        self.replace("src/include/cumulet/cumulet.h", "/* in */", "/* for cumulet_other */")
        self.replace("docs/guide.md", "cumulet_use(", "cumulet_other(")
        self.reported("names.py", "the headers have no 'cumulet_other'")

    def test_an_unknown_flag(self):
        self.replace("docs/guide.md", "-o b.png", "-o b.png --samples 4")
        self.reported("commands.py", "docs/guide.md:13: cumulet-render has no --samples")

    def test_an_unknown_flag_in_prose(self):
        self.replace("docs/guide.md", "Use `--spp`", "Use `--samples`")
        self.reported("commands.py", "docs/guide.md:16: no program has --samples")

    def test_a_value_that_does_not_parse(self):
        self.replace("docs/guide.md", "--spp 4", "--spp four")
        self.reported("commands.py", "docs/guide.md:13: cumulet-render cloud.vdb --spp four -o out.png: status 2: "
                                     "cumulet-render: --spp: no number")

    def run_page(self, **environment):
        scene = self.folder / "scene"
        scene.mkdir(exist_ok=True)
        for name in ("cumulus.vdb", "explosion_0012.vdb", "mountains.glb", "sample.json"):
            (scene / name).write_text("{}")
        return self.run_check("run_commands.py", self.root / "docs/guide.md", scene, self.folder / "out", self.render,
                              **environment)

    def test_commands_run_small(self):
        status, output = self.run_page()
        self.assertEqual(status, 0, output)
        self.assertEqual((self.folder / "out/out.png").read_text(), "cloud.vdb --spp 2 -o out.png --size 32x24")

    def test_a_command_that_writes_nothing(self):
        status, output = self.run_page(WRITES="0")
        self.assertEqual(status, 1, output)
        self.assertIn("guide.md:13: wrote no out.png", output)

    def c_file(self, *arguments):
        out = self.folder / "out.c"
        status, output = self.run_check("c_blocks.py", self.root / "docs/guide.md", out, *arguments)
        return status, output if status else out.read_text()

    def test_c_blocks_as_a_file(self):
        status, text = self.c_file("--whole", "--replace", "cumulet_use", "use")
        self.assertEqual(status, 0, text)
        self.assertRegex(text, r'#line 8 ".*docs/guide.md"\nconst cumulet_thing_desc thing = {.*};\nuse\(&thing\);\n')

    def test_c_blocks_within_a_function(self):
        status, text = self.c_file("--within", "guide.h")
        self.assertEqual(status, 0, text)
        self.assertRegex(text, r'(?s)#include "guide.h".*void guide_page\(void\) {\n#line 8 .*\n{\n}}\n$')

    def test_a_block_by_its_text(self):
        self.assertIn("cumulet-render cloud.vdb --spp 4", self.c_file("--block", "# Two")[1])
        self.assertEqual(self.c_file("--block", "# Three")[0], 1)

    def test_a_replacement_of_nothing(self):
        self.assertIn("'use(3)' occurs 0 times", self.c_file("--whole", "--replace", "use(3)", "use")[1])

    def test_migration(self):
        checkout = HERE.parent.parent
        for name in ("docs/migration.md", "cmake/descriptors.py", "cmake/c_header.py", "demo/render/old_flags.cpp",
                     "demo/render/options.cpp", "demo/scene_file/keys.cpp", "src/settings/settings.hpp",
                     *(f"src/include/cumulet/cumulet{end}" for end in (".h", ".hpp", "_openvdb.hpp"))):
            self.write({name: (checkout / name).read_text(encoding="utf-8")})
        status, output = self.check("migration.py")
        self.assertEqual(status, 0, output)
        page = (self.root / "docs/migration.md").read_text()
        for old, new, expected in (
                ("`cumulet_grid_type` |", "`cumulet_grid_kind` |", "cumulet.h has no 'cumulet_grid_kind'"),
                ("| `cumulet_march` |", "| `cumulet_volume` |", "cumulet.h has still 'cumulet_volume'"),
                ("| `across` | `tangent` |", "| `across` | `u_axis` |", "cumulet_light_desc has no 'u_axis'"),
                ("`GridType::bricks` |", "`GridType::brick_grid` |", "the C++ headers have no 'GridType::brick_grid'"),
                ("| `--lamp` | `--light` |\n", "", "the flags are not those"),
                ("| `lights[].kind` | `disc` | `disk` |\n", "", "the values under 'Scene files' are not those"),
                ("| `grid.march` | `grid.march` | `grid.type` |\n", "", "the keys are not those")):
            self.replace("docs/migration.md", old, new)
            self.reported("migration.py", expected)
            self.write({"docs/migration.md": page})


if __name__ == "__main__":
    unittest.main()
