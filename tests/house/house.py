"""Holds the structure of the source: includes go down only, and classes, functions and files have a maximum size.

usage: house.py ROOT            compare with the limits and bounds.txt; exit status 1 if something differs
       house.py ROOT --report   print the sizes of folders, and the largest classes, functions and files
       house.py ROOT --update   lower the bounds of exceptions and remove those that are no longer needed

The table "Source layout" of docs/architecture.md lists the folders. bounds.txt lists the exceptions: each may shrink,
and then --update lowers its bound. No command adds an exception or raises a bound.
"""

import argparse
import collections
import operator
import os
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "support")]
import cpp  # noqa: E402
import source_tree  # noqa: E402

PAGE = "docs/architecture.md"
SECTION = "## Source layout"
C_OR_CPP = (".h", ".hpp", ".c", ".cpp")
CODE = (*C_OR_CPP, ".inc", ".glsl", ".comp", ".frag", ".vert")
SCRIPTS = (".py", ".py.in", ".sh")  # only the lines of their files are limited
TOPS = {"src": (), "glsl": (), "demo": SCRIPTS, "python": SCRIPTS, "tests": SCRIPTS}
INCLUDE_FOLDERS = ("src", "src/include", "glsl", "tests", "tests/unit")
GL_HEADER = re.compile(r"(?:glad|GL|EGL|KHR)/")
GL_NAME = re.compile(r"GL_[A-Z0-9]\w*|GL[a-z]\w*|PFNGL\w*|Glad\w*")
MAX_SHOWN = 12  # entries per list of --report

# The largest values without a line in bounds.txt. Each include against the table needs a line.
LIMITS = {
    "class": {"data members": 30},
    "function": {"lines": 80, "complexity": 40},
    "file": {"lines": 800},
    "include": {},
    "circle": {"includes": 0},
}
MAX_TEST_LINES = 600  # of a file of tests/, which has a lower limit than other files
RECORD = "record"  # a line for a class or file that is excepted by its name, without a bound
RECORDED = ("class", "file")
UPDATE = "run: python3 tests/house/house.py . --update"

# A row of the table. may_include: names of folders.
Folder = collections.namedtuple("Folder", "name path purpose uses_gl may_include")
# A thing with a limit. where: file and line.
Finding = collections.namedtuple("Finding", "kind name values where")


# --- the table of folders --------------------------------------------------------------------------------------------

def table_rows(text):
    """Rows of the table of the section, each as {heading: cell} with its line number."""
    headings, in_section = None, False
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("#"):
            in_section = line.strip() == SECTION
        if not in_section or not line.startswith("|"):
            if headings:
                return
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if headings is None:
            headings = cells
        elif not set(line) <= set("|-: "):
            yield number, dict(zip(headings, cells))


def read_folders(root):
    """The folders from the lowest to the highest, and the problems of the table."""
    file = root / PAGE
    folders, problems = [], []
    for line, row in table_rows(file.read_text(encoding="utf-8") if file.exists() else ""):
        where = f"{PAGE}:{line}"
        path = row.get("Folder", "").strip("`").rstrip("/")
        name = path.removeprefix("src/")
        above = [folder.name for folder in folders]
        allowed = row.get("May include", "")
        names = above if allowed == "all above" else re.findall(r"`([^`]+)`", allowed)
        if not (root / path).is_dir() or not path:
            problems.append(f"{where}: there is no folder '{path}'")
        if not row.get("Purpose"):
            problems.append(f"{where}: '{path}' has no purpose")
        if row.get("GL") not in ("yes", "no"):
            problems.append(f"{where}: the column GL of '{path}' must be yes or no")
        if not names and allowed != "nothing":
            problems.append(f"{where}: May include of '{path}' must be 'nothing', 'all above' or names in backquotes")
        problems += [f"{where}: '{path}' may not include '{other}', which is not above it"
                     for other in names if other not in above]
        folders.append(Folder(name, path, row.get("Purpose", ""), row.get("GL") == "yes", set(names)))
    if not folders:
        problems.append(f"{PAGE}: the section '{SECTION[3:]}' has no table of folders")
    return folders, problems


# --- the tree --------------------------------------------------------------------------------------------------------

class Tree:
    """The files of a checkout that have limits. Findings are everything that a limit applies to."""

    def __init__(self, root):
        self.root = pathlib.Path(root).resolve()
        self.folders, self.problems = read_folders(self.root)
        self.lines, self.sources, self.folder_of = {}, {}, {}
        for path in source_tree.files(self.root):
            self.read(path)
        self.demo_folders = sorted({os.path.dirname(path) for path in self.sources if path.startswith("demo/")})
        self.targets = {path: self.resolved_includes(path) for path in self.sources}
        self.findings = [*self.classes(), *self.functions(), *self.file_sizes(), *self.upward_includes(),
                         *self.circles()]
        self.check_gl()

    def read(self, path):
        top = path.split("/")[0]
        if top not in TOPS or not path.endswith((*CODE, *TOPS[top])):
            return
        folder = next((f for f in self.folders if path.startswith(f.path + "/")), None)
        if folder is None:
            self.problems.append(f"{path}: its folder is not in the table of {PAGE}")
        text = (self.root / path).read_text(encoding="utf-8", errors="replace")
        self.folder_of[path] = folder
        self.lines[path] = len(text.splitlines())
        if path.endswith(CODE):
            try:
                self.sources[path] = cpp.Source(text)
            except cpp.ParseError as error:
                self.problems.append(f"{path}: {error}")

    def resolved_includes(self, path):
        """(line, path of the included file, or None if it is not in the tree, name) of each include."""
        folders = [os.path.dirname(path), *INCLUDE_FOLDERS]
        if path.startswith(("demo/", "tests/")):
            folders += self.demo_folders
        found = []
        for line, name in self.sources[path].includes:
            candidates = (os.path.normpath(f"{folder}/{name}") for folder in folders)
            found.append((line, next((c for c in candidates if c in self.sources), None), name))
        return found

    # Findings.

    def classes(self):
        for path, source in self.sources.items():
            for one in source.classes:
                yield Finding("class", one.name.removeprefix("cumulet::"), (len(one.members),), f"{path}:{one.line}")

    def functions(self):
        for path, source in self.sources.items():
            for one in source.functions:
                yield Finding("function", f"{path}:{one.name}", (one.lines, one.complexity), f"{path}:{one.line}")

    def file_sizes(self):
        for path, lines in self.lines.items():
            yield Finding("file", path, (lines,), path)

    def upward_includes(self):
        for path, targets in self.targets.items():
            folder = self.folder_of[path]
            for line, target, _ in targets:
                other = self.folder_of.get(target)
                if folder and other and other != folder and other.name not in folder.may_include:
                    yield Finding("include", f"{path} -> {target}", (), f"{path}:{line}")

    def circles(self):
        units = self.units()
        edges = {(path, target) for path, targets in self.targets.items() for _, target, _ in targets
                 if target and units[path] != units[target]}
        graph = collections.defaultdict(set)
        for path, target in edges:
            graph[units[path]].add(units[target])
        for circle in circles_of(graph):
            includes = sorted((path, target) for path, target in edges if {units[path], units[target]} <= circle)
            yield Finding("circle", " ".join(sorted(circle)), (len(includes),),
                          ", ".join(f"{path} -> {target}" for path, target in includes))

    def units(self):
        """{path: unit}. A source file and its header are a unit, which has the name of the source file.

        The header of a source file has the same name. If there is no source file of that name, it is the one of the
        header's folder that includes it and defines functions that it declares, unless there are several.
        """
        units = {path: os.path.splitext(path)[0] if path.endswith(C_OR_CPP) else path for path in self.sources}
        implementations = {path for path in self.sources if path.endswith((".c", ".cpp"))}
        stems = {units[path] for path in implementations}
        defined = {path: {one.full_name for one in self.sources[path].functions} for path in implementations}
        for header in [path for path in self.sources if path.endswith((".h", ".hpp")) and units[path] not in stems]:
            makers = [path for path in implementations if os.path.dirname(path) == os.path.dirname(header)
                      and any(target == header for _, target, _ in self.targets[path])
                      and defined[path] & self.sources[header].declarations]
            if len(makers) == 1:
                units[header] = units[makers[0]]
        return units

    def check_gl(self):
        """Adds a problem for each use of GL in a folder without GL."""
        for path, source in self.sources.items():
            folder = self.folder_of[path]
            if folder is None or folder.uses_gl or not path.endswith(C_OR_CPP):
                continue
            uses = [(line, name) for line, target, name in self.targets[path]
                    if (target or "").startswith("src/gl/") or GL_HEADER.match(name)]
            for token, after in zip(source.tokens, [*source.tokens[1:], None]):
                is_namespace = token.text == "gl" and after and after.text in ("::", "{")
                if is_namespace or GL_NAME.fullmatch(token.text):
                    uses.append((token.line, token.text))
            self.problems += [f"{path}:{line}: '{folder.path}' is free of GL, but uses '{name}'" for line, name in uses]


def circles_of(graph):
    """Sets of nodes of which each is reachable from each other one, by Tarjan's algorithm without recursion."""
    index, low, stack, circles = {}, {}, [], []
    for start in sorted(graph):
        if start in index:
            continue
        work = [(start, iter(()))]
        while work:
            node, edges = work[-1]
            if node not in index:
                index[node] = low[node] = len(index)
                stack.append(node)
                edges = iter(sorted(graph.get(node, ())))
                work[-1] = (node, edges)
            other = next((e for e in edges if e not in index or e in stack), None)
            if other is not None and other not in index:
                work.append((other, iter(())))
            elif other is not None:
                low[node] = min(low[node], index[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    position = stack.index(node)
                    if len(stack) - position > 1:
                        circles.append(set(stack[position:]))
                    del stack[position:]
    return circles


# --- bounds ----------------------------------------------------------------------------------------------------------

def limits_of(kind, name):
    if kind == "file" and name.startswith("tests/"):
        return (MAX_TEST_LINES,)
    return tuple(LIMITS[kind].values())


def exceeds(finding):
    limits = limits_of(finding.kind, finding.name)
    return any(map(operator.gt, finding.values, limits)) or not limits


def beyond(finding, values):
    """The values, with the limit in place of those within it: changes within a limit do not count."""
    return tuple(map(max, values, limits_of(finding.kind, finding.name)))


def has_grown(finding, bound):
    return any(map(operator.gt, beyond(finding, finding.values), beyond(finding, bound)))


def offenders(findings):
    """{(kind, name): finding} of those beyond a limit. The second one of a name has the name NAME#2."""
    found = {}
    for finding in findings:
        if exceeds(finding):
            name, count = finding.name, 1
            while (finding.kind, name) in found:
                count += 1
                name = f"{finding.name}#{count}"
            found[finding.kind, name] = finding._replace(name=name)
    return found


def parsed(line, where):
    """(kind, name, values) of a line of bounds.txt; None for a comment. A record has its reason as value."""
    if not line.strip() or line.startswith("#"):
        return None
    kind, _, rest = line.strip().partition(" ")
    if kind == RECORD:
        name, _, reason = rest.partition(" ")
        if not reason.strip():
            sys.exit(f"{where}: a record needs a reason")
        return kind, name, (reason.strip(),)
    if kind not in LIMITS:
        sys.exit(f"{where}: unknown kind '{kind}'; kinds: {' '.join(LIMITS)} {RECORD}")
    count = len(LIMITS[kind])
    fields = rest.rsplit(" ", count) if count else [rest]
    if len(fields) != 1 + count or not all(field.isdigit() for field in fields[1:]):
        sys.exit(f"{where}: expected {kind} NAME {' '.join(LIMITS[kind]).upper()}")
    return kind, fields[0], tuple(map(int, fields[1:]))


class Bounds:
    """The exceptions of bounds.txt, compared with the tree."""

    def __init__(self, file, tree):
        self.file = file
        self.lines = file.read_text(encoding="utf-8").splitlines()
        self.entries = [parsed(line, f"{file.name}:{number}") for number, line in enumerate(self.lines, 1)]
        self.found = offenders(tree.findings)
        self.listed = {entry[:2]: entry[2] for entry in self.entries if entry}

    def parts(self, name, values):
        """The circles that remain of a listed one."""
        return [finding for (kind, other), finding in self.found.items()
                if kind == "circle" and set(other.split()) < set(name.split()) and finding.values <= values]

    def is_excepted(self, finding):
        """True if a line of another kind or name allows a finding: a record, or a larger circle."""
        if finding.kind in RECORDED:
            return (RECORD, finding.name) in self.listed
        return finding.kind == "circle" and any(kind == "circle" and finding in self.parts(name, values)
                                                for (kind, name), values in self.listed.items())

    def above(self):
        """Messages about findings beyond their limit or bound."""
        for key, finding in self.found.items():
            bound = self.listed.get(key)
            if bound is None and not self.is_excepted(finding):
                yield f"{described(finding)}; {allowed(finding.kind, limits_of(finding.kind, finding.name), 'limit')}"
            elif bound is not None and has_grown(finding, bound):
                yield f"{described(finding)}; {allowed(finding.kind, bound, 'bound')}"

    def needless(self):
        """Messages about lines that --update changes."""
        for entry in filter(None, self.entries):
            remaining = self.updated(entry)
            if remaining != [entry]:
                state = "has become smaller" if remaining else "no longer needs an exception"
                yield f"{self.file.name}: {entry[0]} {entry[1]} {state}; {UPDATE}"

    def updated(self, entry):
        """The lines in place of a line: itself with lower values, the remaining circles, or none."""
        kind, name, values = entry
        if kind == RECORD:
            return [entry] if any((recorded, name) in self.found for recorded in RECORDED) else []
        finding = self.found.get((kind, name))
        if finding is None:
            return [(kind, part.name, part.values) for part in self.parts(name, values)] if kind == "circle" else []
        if beyond(finding, finding.values) == beyond(finding, values):
            return [entry]
        return [(kind, name, tuple(map(min, finding.values, values)))]

    def update(self):
        kept = []
        for line, entry in zip(self.lines, self.entries):
            kept += [line] if entry is None or self.updated(entry) == [entry] else map(written, self.updated(entry))
        self.file.write_text("\n".join(kept) + "\n", encoding="utf-8")


def written(entry):
    return " ".join(map(str, (*entry[:2], *entry[2])))


def described(finding):
    kind, name, values, where = finding
    if kind == "include":
        return f"{where}: include {name}"
    if kind == "circle":
        return f"these files include each other: {name} ({where})"
    return f"{where}: {kind} {name}: {sizes(kind, values)}"


def sizes(kind, values):
    return ", ".join(f"{unit} {value}" for unit, value in zip(LIMITS[kind], values))


def allowed(kind, values, limit):
    if kind == "include":
        return f"the table of {PAGE} does not allow it"
    return f"{limit}: {sizes(kind, values)}"


# --- report ----------------------------------------------------------------------------------------------------------

def largest(findings, kind, value=0):
    return sorted((f for f in findings if f.kind == kind), key=lambda f: (-f.values[value], f.name))[:MAX_SHOWN]


def report(tree, bounds):
    print(f"{'folder':14}{'files':>7}{'lines':>8}{'classes':>9}{'functions':>11}")
    for folder in tree.folders:
        paths = [path for path, other in tree.folder_of.items() if other == folder]
        sources = [tree.sources[path] for path in paths if path in tree.sources]
        print(f"{folder.path:14}{len(paths):7}{sum(tree.lines[path] for path in paths):8}"
              f"{sum(len(s.classes) for s in sources):9}{sum(len(s.functions) for s in sources):11}")
    for kind, value, title in (("class", 0, "classes, data members"), ("function", 0, "functions, lines"),
                               ("function", 1, "functions, complexity"), ("file", 0, "files, lines")):
        print(f"\nLargest {title}:")
        for finding in largest(tree.findings, kind, value):
            print(f"{finding.values[value]:6}  {finding.name}")
    literals = {path: sum(token.kind == "string" and "CM_" in token.text for token in source.tokens)
                for path, source in tree.sources.items() if path.startswith("src/")}
    print(f'\n"CM_" string literals of src: {sum(literals.values())} in {sum(map(bool, literals.values()))} files')
    counts = collections.Counter(kind for kind, _ in bounds.listed)
    kinds = ", ".join(f"{kind} {counts[kind]}" for kind in (*LIMITS, RECORD))
    print(f"exceptions: {sum(counts.values())} ({kinds})")


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n\n")[0])
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--bounds", type=pathlib.Path, default=HERE / "bounds.txt",
                        help="in place of the file beside this one")
    arguments = parser.parse_args()
    tree = Tree(arguments.root)
    bounds = Bounds(arguments.bounds, tree)
    if not tree.sources:
        sys.exit(f"{arguments.root}: no sources found")
    if arguments.report:
        report(tree, bounds)
    elif arguments.update:
        bounds.update()
    else:
        problems = [*tree.problems, *bounds.above(), *bounds.needless()]
        print("\n".join(problems) or f"{len(tree.sources)} files of code, {len(bounds.listed)} exceptions")
        sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
