"""The Markdown pages of a checkout: their headings, prose, code blocks and commands, with line numbers."""

import collections
import fnmatch
import pathlib
import re
import shlex
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "support"))
import source_tree  # noqa: E402

NOT_OURS = "third_party_notes/*"
# The prose of these pages and sections has names of earlier versions.
EARLIER_PAGES = ("docs/migration.md",)
EARLIER_SECTIONS = ("Breaking",)

# A fenced block has the language of its fence, an indented one "indented". line: of its first line of text.
Block = collections.namedtuple("Block", "language line text")
Command = collections.namedtuple("Command", "page line text")


def blank(text):
    """Spaces in place of all but the line ends."""
    return re.sub(r"[^\n]", " ", text)


class Page:
    def __init__(self, path, text):
        self.path, self.text = path, text
        self.blocks, self.headings, prose = [], [], []
        fence, block, first, section, self.sections = None, [], 0, "", []
        lines = text.split("\n")
        for number, line in enumerate(lines, 1):
            mark = re.match(r"\s*```(\w*)", line)
            indented = line.startswith("    ") and (block or number == 1 or not lines[number - 2].strip())
            if fence is not None:
                if mark:
                    self.blocks.append(Block(fence or "text", first, "\n".join(block)))
                    fence, block = None, []
                else:
                    block.append(line)
                prose.append("")
            elif mark:
                self.end_indented(block, first)
                fence, block, first = mark.group(1), [], number + 1
                prose.append("")
            elif indented or (block and not line.strip()):
                first = first if block else number
                block.append(line[4:])
                prose.append("")
            else:
                self.end_indented(block, first)
                block = []
                heading = re.match(r"(#+)\s+(.*?)\s*#*$", line)
                if heading:
                    section = heading.group(2)
                    self.headings.append(section)
                prose.append(line)
            self.sections.append(section)
        self.end_indented(block, first)
        self.prose = re.sub(r"<!--.*?-->", lambda m: blank(m.group(0)), "\n".join(prose), flags=re.S)
        self.prose_without_code = re.sub(r"`[^`]+`", lambda m: blank(m.group(0)), self.prose)

    def end_indented(self, block, first):
        if block:
            self.blocks.append(Block("indented", first, "\n".join(block).rstrip()))

    def section_of(self, line):
        """The heading above a line."""
        return self.sections[line - 1]

    def is_of_earlier_versions(self, line):
        """Returns whether the prose of a line may have names that no longer exist."""
        return self.path in EARLIER_PAGES or self.section_of(line) in EARLIER_SECTIONS

    def anchors(self):
        """The fragments that GitHub gives to the headings, and those of HTML anchors."""
        found, seen = set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", self.text)), collections.Counter()
        for heading in self.headings:
            shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
            slug = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
            found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
            seen[slug] += 1
        return found

    def spans(self):
        """(line, text) of code within prose."""
        for match in re.finditer(r"`([^`]+)`", self.prose):
            yield self.prose.count("\n", 0, match.start()) + 1, re.sub(r"\s*\n\s*", " ", match.group(1))


def pages(root, pattern="*.md"):
    """Every page of the project whose path has the pattern."""
    root = pathlib.Path(root)
    return [Page(path, (root / path).read_text(encoding="utf-8")) for path in source_tree.files(root)
            if path.endswith(".md") and fnmatch.fnmatch(path, pattern) and not fnmatch.fnmatch(path, NOT_OURS)]


def split_line(page, number, line):
    """The commands of a shell line, which && and ; separate. Comments and assignments before a command are left out."""
    words = shlex.shlex(re.sub(r"(?:^|\s+)#\s.*$", "", line), posix=True, punctuation_chars="&;|")
    words.whitespace_split, words.commenters = True, ""
    command = []
    for word in [*words, ";"]:
        if re.fullmatch(r"[&;|]+", word):
            if command:
                yield Command(page.path, number, command)
            command = []
        elif command or not re.fullmatch(r"[A-Z_]+=.*", word):
            command.append(word)


def block_commands(page, programs):
    """The commands in blocks that begin with one of the programs, as lists of words."""
    for block in page.blocks:
        if block.language not in ("indented", "sh", "bash", "text"):
            continue
        line, number = "", 0
        for offset, text in enumerate(block.text.split("\n")):
            number = number if line else block.line + offset
            line += text
            if line.endswith("\\"):
                line = line[:-1] + " "
                continue
            if re.search(rf"(?:^|[\s/])(?:{'|'.join(map(re.escape, programs))})(?:\s|$)", line):
                for command in split_line(page, number, line):
                    if command.text[0].rsplit("/", 1)[-1] in programs:
                        yield command
            line = ""


def span_commands(page, programs):
    """The commands in prose that begin with one of the programs."""
    for number, text in page.spans():
        if text.split(" ")[0] in programs and " " in text:
            try:
                yield from (c for c in split_line(page, number, text) if c.text[0] in programs)
            except ValueError as error:
                sys.exit(f"{page.path}:{number}: '{text}': {error}")


def report(name, problems, checked):
    """Prints the problems, ends with status 1 if there are any, and also if nothing was checked."""
    for problem in problems:
        print(problem)
    print(f"{name}: {checked} checked, {len(problems)} wrong")
    sys.exit(bool(problems) or not checked)
