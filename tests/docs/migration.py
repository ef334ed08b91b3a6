"""The tables of docs/migration.md agree with the headers and the programs.

Each new name exists. No old name does, unless it is also a new one. The sed script of the page renames in the right
order. Flags, keys and values are those of the tables in demo/render/old_flags.cpp, demo/scene_file/keys.cpp and
src/settings/settings.hpp.

usage: migration.py ROOT
"""

import pathlib
import re
import subprocess
import sys
import tempfile

from names import structs_of, without_comments
from pages import report

WORD = re.compile(r"[A-Za-z_]\w*")


def words_of(text):
    return set(WORD.findall(without_comments(text)))


class Migration:
    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.page = self.read("docs/migration.md")
        self.problems, self.checked = [], 0
        self.header = self.read("src/include/cumulet/cumulet.h")
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "cumulet_descriptors.hpp"
            subprocess.run([sys.executable, "-B", self.root / "cmake/descriptors.py", "--out", out,
                            self.root / "src/include/cumulet/cumulet.h"], check=True)
            self.cpp = out.read_text(encoding="utf-8") + "".join(
                self.read(f"src/include/cumulet/{name}") for name in ("cumulet.hpp", "cumulet_openvdb.hpp"))

    def read(self, path):
        return (self.root / path).read_text(encoding="utf-8")

    def expect(self, holds, problem):
        self.checked += 1
        if not holds:
            self.problems.append(f"docs/migration.md: {problem}")

    def rows(self, section, columns, number=0):
        """The rows of a table: the one with this number among those with so many columns of the section."""
        text = self.page.split(f"\n## {section}\n")[1].split("\n## ")[0]
        tables = re.findall(r"^\|(?:[^\n|]*\|)+\n\|[-|]+\n((?:\|[^\n]*\n)*)", text, flags=re.M)
        found = [[[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in table.splitlines()]
                 for table in tables]
        found = [table for table in found if table and len(table[0]) == columns]
        return found[number] if columns != 2 or number else [row for table in found for row in table]

    def check_c(self):
        words = words_of(self.header)
        rows = self.rows("C", 2)
        new = {now for _, now in rows}
        for i, (old, now) in enumerate(rows):
            self.expect(now in words, f"cumulet.h has no '{now}'")
            self.expect(old not in words or old in new, f"cumulet.h has still '{old}'")
            self.expect(now not in [later for later, _ in rows[i:]], f"'{now}' would be renamed again by a later row")
        script = re.search(r"sed -n '(.*)' migration\.md", self.page)
        self.expect(script is not None, "there is no sed script")
        if script:
            made = subprocess.run(["sed", "-n", script[1], self.root / "docs/migration.md"], check=True, capture_output=True,
                                  text=True).stdout
            old = "\n".join(old for old, _ in rows)
            with tempfile.TemporaryDirectory() as folder:
                names, host = pathlib.Path(folder) / "names.sed", pathlib.Path(folder) / "host.c"
                names.write_text(made)
                host.write_text(old)
                done = subprocess.run(["sed", "-f", names, host], check=True, capture_output=True, text=True)
            for wanted, found in zip((now for _, now in rows), done.stdout.split("\n"), strict=True):
                self.expect(found == wanted, f"the sed script makes '{found}' of the name before '{wanted}'")
        structs = structs_of(self.header)
        for struct, old, now in self.rows("C", 3):
            fields = structs.get(struct, set())
            self.expect(now in fields, f"{struct} has no '{now}'")
            self.expect(old not in fields, f"{struct} has still '{old}'")

    def check_cpp(self):
        text = without_comments(self.cpp)
        rows = self.rows("C++", 2)
        new = {now for _, now in rows}

        def has(name):
            scope, _, member = name.rpartition("::")
            if not scope:
                return re.search(rf"\b{member}\b", text) is not None
            body = re.search(rf"\n(?:enum class|struct|class) {scope}\b[^;{{]*\{{(.*?)\n\}};", text, flags=re.S)
            return body is not None and re.search(rf"\b{member}\b", body[1]) is not None

        for old, now in rows:
            self.expect(has(now), f"the C++ headers have no '{now}'")
            self.expect(not has(old) or old in new, f"the C++ headers have still '{old}'")

    def check_programs(self):
        flags = re.findall(r'OldFlag\{"(--[\w-]+)", "(--[\w-]+)"\}', self.read("demo/render/old_flags.cpp"))
        self.expect(bool(flags) and flags == [tuple(row) for row in self.rows("Command lines", 2)],
                    "the flags are not those of demo/render/old_flags.cpp")
        settings = self.read("src/settings/settings.hpp")
        for _, now in flags:
            found = any(f'"{now}"' in text for text in (settings, self.read("demo/render/options.cpp")))
            self.expect(found, f"the programs have no '{now}'")

        values = re.findall(r'Choice\{"([\w-]+)",[^{}]*,\s*"([\w-]+)"\}', settings)
        values = {(old, now) for now, old in values if re.fullmatch(r"[a-z]+", old)}
        for section in ("Command lines", "Scene files"):
            rows = [row for row in self.rows(section, 3, 0 if section == "Command lines" else 1) if "=" not in row[1]]
            self.expect({(old, now) for _, old, now in rows} == values and len(rows) == len(values),
                        f"the values under '{section}' are not those of src/settings/settings.hpp")

        keys = re.findall(r'Renamed\{"([\w.\[\]]+)",\s*"([\w.\[\]]*)",\s*"([\w.\[\]]+)"\}', self.read("demo/scene_file/keys.cpp"))

        def moved(key):
            for section, path in (("volume", "volumes[]"), ("medium", "volumes[].medium"), ("surfaces", "models[0]")):
                if key.startswith(section + "."):
                    return path + key[len(section):]
            return key

        wanted = {(first, moved(second), moved(now)) for now, first, second in keys}
        self.expect(bool(wanted) and {tuple(row) for row in self.rows("Scene files", 3, 0)} == wanted,
                    "the keys are not those of demo/scene_file/keys.cpp")


def check(root):
    """Problems, and the number of rows."""
    migration = Migration(root)
    migration.check_c()
    migration.check_cpp()
    migration.check_programs()
    return migration.problems, migration.checked


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    report("names of the migration", *check(sys.argv[1]))
