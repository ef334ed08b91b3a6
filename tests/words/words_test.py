"""words.py reports a bad sentence and a home-made word with file and line, and accepts good ones."""

import pathlib
import re
import shutil
import subprocess
import sys
import unittest

WORDS = pathlib.Path(__file__).resolve().with_name("words.py")
sys.path.insert(0, str(WORDS.parent.parent / "support"))
import checkout  # noqa: E402

AREAS = ("header", "src", "glsl", "demo", "docs", "build", "tests", "identifiers")
GOOD = {
    "src/a.cpp": '/// Returns the next sample.\n/// index: of the sample, from 0.\nint next(int index) { return index; }\n'
                 'const char* text = "// Of others, what is told anew";\n',
    "docs/a.md": "# Of a thing\n\nThe renderer writes one file. Do not say \"what is told\".\n\n    what is in a block\n\n"
                 "```c\n/* Of what is told. */\n```\n",
    "cmake/a.py": '"""Writes the table.\n\nusage: what FILE\n"""\nX = 1  # The number of rows in it.\n',
    "src/a.sh": "#!/bin/bash\n# The script builds the library.\n",
}


class Checkout(checkout.Checkout):
    def setUp(self):
        super().setUp()
        self.bounds = self.folder / "bounds.txt"
        self.write(GOOD)
        self.bound(dict.fromkeys(AREAS, 0))

    def bound(self, bounds):
        self.bounds.write_text("# percent\n" + "".join(f"{name} {bound}\n" for name, bound in bounds.items()))

    def bounds_now(self):
        return dict(line.split() for line in self.bounds.read_text().splitlines() if not line.startswith("#"))

    def words(self, *arguments):
        """Exit status and output of words.py."""
        done = subprocess.run([sys.executable, "-B", WORDS, self.root, "--bounds", self.bounds, *arguments],
                              capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    def reported(self, files, *expected):
        self.write(files)
        status, output = self.words()
        self.assertEqual(status, 1, output)
        for line in expected:
            self.assertRegex(output, "(?m)^" + re.escape(line))

    def test_good_sentences_pass(self):
        status, output = self.words()
        self.assertEqual(status, 0, output)
        self.assertEqual(self.words("--list", "any"), (0, ""))

    def test_a_bad_sentence_in_a_line_comment(self):
        self.reported({"src/b.cpp": "int a;\n/// Holds a lock.\n/// Of others it holds none.\nint b;\n"},
                      "src/b.cpp:3: [no-subject] Of others it holds none.")

    def test_a_bad_sentence_in_a_block_comment(self):
        self.reported({"src/include/c.h": "/**\n * Sets the light.\n *\n * @param error is told the cause at once\n */\n"},
                      "src/include/c.h:4: [told] is told the cause at once")

    def test_a_bad_sentence_after_code(self):
        self.reported({"glsl/b.comp": "uint a;  // the bytes a pixel takes\n"}, "glsl/b.comp:1: [a-per] the bytes a pixel takes")

    def test_a_bad_sentence_in_a_document(self):
        self.reported({"README.md": "# Title\n\nIt is read anew. The file\nholds what is there.\n"},
                      "README.md:3: [anew] It is read anew.", "README.md:3: [what] The file holds what is there.")

    def test_bad_sentences_of_scripts(self):
        self.reported({"cmake/b.py": '"""Writes all.\n\nNobody reads the rest of it.\n"""\n',
                       "tests/b.sh": "x=1\n# Whoever calls it waits.\n"},
                      "cmake/b.py:3: [nobody] Nobody reads", "tests/b.sh:2: [nobody] Whoever calls it waits.")

    def test_for_in_place_of_because(self):
        self.reported({"src/b.cpp": "// It waits, for the driver is slow.\n"}, "src/b.cpp:1: [for-because] It waits")
        self.write({"src/b.cpp": "// Returns 1, for a medium that does not emit.\n"})
        self.assertEqual(self.words()[0], 0)

    def test_a_long_sentence(self):
        self.reported({"src/b.cpp": "// The " + "very " * 40 + "long one.\n"}, "src/b.cpp:1: [long] The very")

    def test_home_made_identifiers(self):
        self.reported({"src/b.cpp": "int bytes_a_pixel(int GridShelf, int colour, int most_bytes, int color, int almost_bytes);\n"},
                      "home-made words in identifiers: 4, bound 0", "     1 bytes_a_pixel", "     1 GridShelf")

    def test_identifiers_of_tests_do_not_count(self):
        self.write({"tests/b.cpp": "int colour;\n"})
        self.assertEqual(self.words()[0], 0)

    def test_the_glossary_explains_identifiers(self):
        self.write({"src/b.cpp": "int shelf, colour;\n", "docs/glossary.md": "A shelf is an asynchronous cache.\n"})
        self.assertRegex(self.words("--identifiers")[1], r"(?m)^ +1 shelf\n +1 colour  \(not in docs/glossary.md\)$")

    def test_update_only_lowers(self):
        self.write({"src/b.cpp": "// Nobody reads it.\n"})
        self.bound(dict.fromkeys(AREAS, 90) | {"src": 20, "tests": 7})
        self.assertEqual(self.words("--update")[0], 0)
        bounds = self.bounds_now()
        self.assertEqual((bounds["src"], bounds["docs"], bounds["tests"], bounds["identifiers"]), ("20", "0.5", "0", "0"))
        self.assertIn("# percent", self.bounds.read_text())

    def test_an_area_without_a_bound(self):
        self.bound({"src": 5})
        status, output = self.words()
        self.assertEqual(status, 1)
        self.assertIn("no bound for header", output)

    @unittest.skipUnless(shutil.which("git"), "needs git")
    def test_files_that_git_ignores(self):
        self.write({".gitignore": "made/\n", "src/made/b.cpp": "// Nobody reads it.\n"})
        self.assertEqual(self.words()[0], 1)
        subprocess.run(["git", "init", "--quiet", self.root], check=True)
        self.assertEqual(self.words()[0], 0)


if __name__ == "__main__":
    unittest.main()
