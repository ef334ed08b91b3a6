"""Counts habits of style in the sentences of comments and documents, and home-made words in identifiers.

usage: words.py ROOT                        compare with bounds.txt; exit status 1 if a value is above its bound
       words.py ROOT --list HABIT [AREA]    print each sentence with a habit ("any": with one at least)
       words.py ROOT --identifiers          print the home-made words in identifiers, the most frequent first
       words.py ROOT --update               lower the bounds to the present values; a bound never rises

An area's value is the percentage of its sentences that have a habit. The value of `identifiers` is a number of
occurrences. CONTRIBUTING.md, "Words", has the rules behind the habits. docs/glossary.md has the field's terms.
"""

import argparse
import ast
import collections
import io
import math
import pathlib
import re
import sys
import tokenize

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import source_tree  # noqa: E402

MAX_WORDS = 32  # of a sentence; rule 11 asks for 25
MAX_SHOWN = 20  # sentences per area above its bound
MARGIN = 0.5  # percent above a measured value at which --update sets the bound of an area
WITHOUT_MARGIN = ("tests", "identifiers")

UNITS = "bits bytes cells frames megabytes kilobytes numbers rays records registers samples seconds steps times words"
THINGS = ("brick cell context draw frame lane look mesh million path picture pixel ray second step thread triangle "
          "vertex viewer volume voxel")

# Patterns that are searched in each clause of a sentence, which ends at a colon or semicolon.
HABITS = {
    "what": re.compile(r"\bwhat\b(?!:)(?! (?:is|are|does|do) \w+\?)", re.I),
    "no-subject": re.compile(r"^(?:(?:Of|Likewise|As there|Which|Where it|And|Nor|From now on|None where)\b|The same[.,;:]|"
                             r"(?:The same|That|Those) (?:after|as|before|by|for|from|if|in|of|that|to|where|which|who|with)\b)"),
    "told": re.compile(r"\b(?:told|tells?|telling)\b", re.I),
    "anew": re.compile(r"\banew\b", re.I),
    "apart": re.compile(r"\bapart\b(?! from)", re.I),
    "alone": re.compile(r"\balone\b", re.I),
    "for-because": re.compile(r", for (?:an?|both|each|it|its|no|some|the|there|they|those|what) "
                              r"(?:(?!\b(?:that|which|who|whose|where|if|for)\b)[^,]){0,60}"
                              r"\b(?:is|are|was|were|has|have|does|do|can|may|would)\b"),
    "stands": re.compile(r"\bstands?\b(?! still)", re.I),
    "a-per": re.compile(rf"\b(?:{'|'.join(UNITS.split())}|[KMG]i?B) an? (?:{'|'.join(THINGS.split())})\b"),
    "nobody": re.compile(r"\b(?:nobody|somebody|whoever|whatever)\b", re.I),
    "owes": re.compile(r"\b(?:owe[sd]?|wish(?:es|ed)?)\b", re.I),
}
LONG = "long"
ANY = "any"

# Home-made words, as parts of identifiers in snake case. docs/glossary.md explains those that remain.
WORDS = re.compile(
    r"(?:^|_)(?:looks?_for|cm_look|(?<!in_)(?<!free_)flights?|facts?|wish(?:es)?|shel(?:f|ves)|allowance|obstacles?|rehears\w*|standings?|"
    r"stand_ins?|lamps?|glow|tend|owes|believed|recalled|closed_ranks|ranks_closed|there_and_back|judg\w*|hasty?e?|rich|"
    r"gloss|most_\w+|least_\w+|\w+_a_(?:brick|cell|frame|level|mesh|million|path|pixel|ray|second|step|vertex|volume|voxel)|"
    r"colour\w*|riddle|house)(?:_|$)")

C_LIKE = (".h", ".hpp", ".c", ".cpp", ".glsl", ".comp", ".frag", ".vert", ".inc")
HASH = (".sh", ".cmake", "CMakeLists.txt", ".in")
AREAS = ("header", "src", "glsl", "demo", "docs", "build", "tests")

# A comment or document as text, with the line of each character.
Block = collections.namedtuple("Block", "text lines")
Sentence = collections.namedtuple("Sentence", "area path line text habits")


def area_of(path):
    if path.endswith(".md"):
        return "docs" if "/" not in path or path.startswith("docs/") else None
    if not path.endswith((".py", *C_LIKE, *HASH)) or path.startswith("docs/"):
        return None
    if path.startswith("tests/"):
        return "tests"
    if not path.endswith(C_LIKE):
        return "build"
    if path.startswith("src/include/"):
        return "header"
    folder = path.split("/")[0]
    return folder if folder in ("src", "glsl", "demo") else None


# --- comments and paragraphs -----------------------------------------------------------------------------------------

PREFORMATTED = re.compile(r"\S {3,}\S|\|.*\|")  # columns and tables


def blocks_of(lines):
    """Joins (line number, text) pairs. A block ends at None, at a blank or preformatted line and before a list item."""
    parts, numbers = [], []

    def finished():
        block = Block("".join(parts), list(numbers))
        parts.clear()
        numbers.clear()
        return block

    for number, text in lines:
        text = (text or "").strip()
        if PREFORMATTED.search(text):
            text = ""
        item = re.match(r"(?:[-*]|\d+\.)\s+(.*)", text)
        if parts and (not text or item):
            yield finished()
        if text:
            kept = (item.group(1) if item else text) + " "
            parts.append(kept)
            numbers.extend([number] * len(kept))
    if parts:
        yield finished()


C_TOKEN = re.compile(r'R"(?P<tag>[^\s()]*)\(.*?\)(?P=tag)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|//[^\n]*|/\*.*?\*/', re.S)
DOXYGEN = re.compile(r"^[@\\](?:param(?:\[[a-z,]*\])?\s+\w+|tparam\s+\w+|retval\s+\w+|[a-z]+)\s*")


def split_c(text):
    """Comments of C, C++ or GLSL as (line, text) pairs, and the code without comments and strings."""
    comments, code, position, line = [], [], 0, 1
    last_line = 0  # of a comment that fills its lines
    for match in C_TOKEN.finditer(text):
        line += text.count("\n", position, match.start())
        code.append(text[position:match.start()])
        token, position = match.group(0), match.end()
        if not token.startswith(("//", "/*")):
            code.append(" ")
            line += token.count("\n")
            continue
        whole_line = not text[text.rfind("\n", 0, match.start()) + 1:match.start()].strip()
        if not (whole_line and line == last_line + 1 and token.startswith("//")):
            comments.append((line, None))
        if token.startswith("//"):
            comments.append((line, token.lstrip("/").removeprefix("<")))
        else:
            body = token[2:-2].lstrip("*!<")
            for offset, one in enumerate(body.split("\n")):
                comments.append((line + offset, re.sub(r"^\s*\*+(?!\w)", "", one)))
            comments.append((line, None))
        line += token.count("\n")
        last_line = line if whole_line else 0
    code.append(text[position:])
    return [(n, t if t is None else without_tag(t)) for n, t in comments], "".join(code)


def without_tag(text):
    text = text.strip()
    if re.match(r"NOLINT|clang-format|IWYU|namespace\b", text):
        return None
    return DOXYGEN.sub("", text)


def python_comments(text):
    comments = []
    try:
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT and not token.string.startswith(("#!", "# noqa")):
                number = token.start[0]
                if not (comments and comments[-1][0] == number - 1 and token.line.strip().startswith("#")):
                    comments.append((number, None))
                comments.append((number, token.string.lstrip("# ")))
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node, clean=False):
                first = node.body[0].lineno
                comments.append((first, None))
                comments += [(first + i, one) for i, one in enumerate(node.body[0].value.value.split("\n"))
                             if not re.match(r"\s*usage:", one, re.I)]
    except (SyntaxError, tokenize.TokenError):  # a template
        return hash_comments(text)
    return comments


def hash_comments(text):
    comments = []
    for number, line in enumerate(text.split("\n"), 1):
        match = re.match(r"(?:.*\s)?#(?![!#])\s?(.*)", line)
        whole_line = line.lstrip().startswith("#")
        if not match or match.group(1).startswith("shellcheck") or (not whole_line and re.search(r"""["'$]""", match.group(1))):
            comments.append((number, None))
            continue
        if not whole_line:
            comments.append((number, None))
        comments.append((number, match.group(1).strip("- ")))
    return comments


def markdown_lines(text):
    """The prose of a page: without code, tables, headings and pictures."""
    in_code = False
    for number, line in enumerate(text.split("\n"), 1):
        if line.lstrip().startswith("```"):
            in_code = not in_code
        if in_code or re.match(r"```| {4}|\||!\[|#|<!--", line):
            yield number, None
        else:
            yield number, re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", line)


def comment_lines(path, text):
    """(line, text) pairs of a file's prose, and its code if identifiers are counted there."""
    if path.endswith(".md"):
        return markdown_lines(text), ""
    if path.endswith(C_LIKE):
        return split_c(text)
    return (python_comments(text) if path.endswith(".py") else hash_comments(text)), ""


# --- sentences -------------------------------------------------------------------------------------------------------

# Words that are quoted, and names of code: a call, a scoped name, a path.
QUOTED = re.compile(r"""`[^`]*`|"[^"]*"|[\w.]+(?:(?:::|/)[\w.]*\w)+(?:\(\))?|\w+\(\)""")
# A sentence ends before a capital, before a name of code and before a parameter's name with a colon.
END = re.compile(r"""(?<=[.!?])[)"*]*\s+(?=[^a-z]|[a-z]+[_A-Z]\w|[a-z]\w*(?:, [a-z]\w*)*: )""")


def plain(text):
    """The text with an equally long X in place of quoted words and names of code."""
    return QUOTED.sub(lambda m: "X" * len(m.group(0)), text)


def sentences_of(block):
    """The sentences of at least three words: (line, as written, without quoted words and names)."""
    text, start = plain(block.text), 0
    for end in [m.end() for m in END.finditer(text)] + [len(text)]:
        if len(text[start:end].split()) > 2:
            yield block.lines[start], block.text[start:end].strip(), text[start:end].strip()
        start = end


def habits_of(sentence):
    clauses = re.split(r"(?<=[;:])\s+", sentence)
    found = [name for name, pattern in HABITS.items() if any(pattern.search(clause) for clause in clauses)]
    if len(sentence.split()) > MAX_WORDS:
        found.append(LONG)
    return found


def home_made(identifier):
    """The home-made word in an identifier, or None."""
    snake = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", identifier).lower().strip("_")
    match = WORDS.search(snake)
    return match.group(0).strip("_") if match else None


class Measure:
    """Sentences with their habits, and identifiers with home-made words, of a checkout."""

    def __init__(self, root):
        self.sentences, self.identifiers = [], collections.Counter()
        for path in source_tree.files(root):
            area = area_of(path)
            if area is None:
                continue
            text = (pathlib.Path(root) / path).read_text(encoding="utf-8", errors="replace")
            lines, code = comment_lines(path, text)
            for block in blocks_of(lines):
                for line, shown, sentence in sentences_of(block):
                    self.sentences.append(Sentence(area, path, line, shown, habits_of(sentence)))
            if area != "tests":
                self.identifiers.update(name for name in re.findall(r"[A-Za-z_]\w*", code) if home_made(name))

    def with_habit(self, habit, area=None):
        return [s for s in self.sentences
                if (area is None or s.area == area) and (s.habits if habit == ANY else habit in s.habits)]

    def percent(self, habit, area):
        count = sum(s.area == area for s in self.sentences)
        return 100.0 * len(self.with_habit(habit, area)) / count if count else 0.0

    def value(self, name):
        """The number that bounds.txt bounds."""
        return sum(self.identifiers.values()) if name == "identifiers" else self.percent(ANY, name)


def show(sentence):
    return f"{sentence.path}:{sentence.line}: [{' '.join(sentence.habits)}] {sentence.text}"


# --- bounds ----------------------------------------------------------------------------------------------------------

def read_bounds(file):
    lines = [line.split("#")[0].split() for line in file.read_text().splitlines()]
    return {fields[0]: float(fields[1]) for fields in lines if fields}


def update(file, measure):
    bounds = read_bounds(file) if file.exists() else {}
    kept = [line for line in file.read_text().splitlines() if line.startswith("#")] if file.exists() else []
    for name in (*AREAS, "identifiers"):
        margin = 0.0 if name in WITHOUT_MARGIN else MARGIN
        value = math.ceil(10.0 * (measure.value(name) + margin) - 1e-9) / 10.0
        bounds[name] = min(bounds.get(name, math.inf), value)
    kept += [f"{name} {bounds[name]:g}" for name in (*AREAS, "identifiers")]
    file.write_text("\n".join(kept) + "\n")


def compare(file, measure):
    """Prints a table, and the sentences of areas above their bounds. Returns the names above."""
    bounds = read_bounds(file)
    missing = [name for name in (*AREAS, "identifiers") if name not in bounds]
    if missing:
        sys.exit(f"{file}: no bound for {', '.join(missing)}")
    columns = [*HABITS, LONG, ANY]
    print(f"{'%':8}{'sentences':>10}" + "".join(f"{c:>12}" for c in columns) + f"{'bound':>8}")
    for area in AREAS:
        count = sum(s.area == area for s in measure.sentences)
        print(f"{area:8}{count:10}" + "".join(f"{measure.percent(c, area):12.1f}" for c in columns)
              + f"{bounds[area]:8.1f}")
    print(f"home-made words in identifiers: {measure.value('identifiers')}, bound {bounds['identifiers']:g}")
    above = [name for name in (*AREAS, "identifiers") if measure.value(name) > bounds[name] + 1e-9]
    for name in above:
        print(f"\n{name}: {measure.value(name):.2f} is above the bound {bounds[name]:g}. "
              f"CONTRIBUTING.md (Words) has the rules. The worst:")
        if name == "identifiers":
            print_identifiers(measure, None, MAX_SHOWN)
        for sentence in sorted(measure.with_habit(ANY, name), key=lambda s: -len(s.habits))[:MAX_SHOWN]:
            print(show(sentence))
    return above


def print_identifiers(measure, glossary, limit=None):
    for name, count in measure.identifiers.most_common(limit):
        word = home_made(name)
        unexplained = "" if glossary is None or word.lower().replace("_", " ") in glossary else "  (not in docs/glossary.md)"
        print(f"{count:6} {name}{unexplained}")


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n\n")[0])
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--list", nargs="+")
    parser.add_argument("--identifiers", action="store_true")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--bounds", type=pathlib.Path, default=HERE / "bounds.txt", help="in place of the file beside this one")
    arguments = parser.parse_args()
    measure = Measure(arguments.root)
    if not measure.sentences:
        sys.exit(f"{arguments.root}: no sentences found")
    if arguments.list:
        habit, area = (*arguments.list, None)[:2]
        if habit not in (*HABITS, LONG, ANY) or area not in (*AREAS, None):
            sys.exit(f"habits: {' '.join([*HABITS, LONG, ANY])}; areas: {' '.join(AREAS)}")
        for sentence in measure.with_habit(habit, area):
            print(show(sentence))
    elif arguments.identifiers:
        file = arguments.root / "docs/glossary.md"
        print_identifiers(measure, file.read_text().lower().replace("_", " ") if file.exists() else "")
    elif arguments.update:
        update(arguments.bounds, measure)
    elif compare(arguments.bounds, measure):
        sys.exit(1)


if __name__ == "__main__":
    main()
