"""Every name of the API in the documents exists.

In code blocks, names of `cumulet_*` and `CUMULET_*` are those of the public headers, and so are the members of structs.
In prose such a name may also be one of the build, of a test or of an internal function. `FIELD` of `STRUCT`, and
`STRUCT.FIELD`, are fields of that struct. Breaking changes may name the past.

usage: names.py ROOT
"""

import pathlib
import re
import sys

from pages import blank, pages, report
import source_tree

NAME = re.compile(r"\b(?:cumulet|CUMULET)_\w+")
MEMBER = re.compile(r"(?<![\w.\"])\.([a-z_]\w*)\b(?!\()|(?<=[\w)\]])(?:\.|->)([a-z_]\w*)\b(?!\()")
OF_STRUCT = re.compile(r"`(\w+)`(?: =? ?\S+)? of `(cumulet_\w+)`")
IN_STRUCT = re.compile(r"(cumulet_\w+)(?:\.|::)(\w+)")
CODE = ("c", "cpp", "glsl")
EXAMPLES = "Words"  # a section whose prose has examples of names


def without_comments(text):
    return re.sub(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\n])*\"", " ", text, flags=re.S)


def structs_of(header):
    """Name -> fields of each struct that a C header defines."""
    found = {}
    for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\} \1;", without_comments(header), flags=re.S):
        found[name] = set(re.findall(r"(\w+)(?:\[\w+\])*(?=[,;])", body)) | set(re.findall(r"\(\*(\w+)\)", body))
    return found


class Names:
    def __init__(self, root):
        files = source_tree.files(root)
        headers = [(root / path).read_text(encoding="utf-8") for path in files if path.startswith("src/include/")]
        self.structs = {name: fields for header in headers for name, fields in structs_of(header).items()}
        self.public = {word for header in headers for word in re.findall(r"[A-Za-z_]\w*", without_comments(header))}
        self.fields = set().union(*self.structs.values()) if self.structs else set()
        self.all = set(self.public)
        for path in files:
            if not path.endswith((".md", ".png", ".webp", ".exr")) and not path.startswith("docs/"):
                text = (root / path).read_text(encoding="utf-8", errors="ignore")
                self.all.update(NAME.findall(text))

    def unknown(self, name, names):
        """Whether a name, or one that begins with NAME_, is missing."""
        return name not in names and not (name.endswith("_") and any(known.startswith(name) for known in names))


def own_fields(page):
    """Fields of structs and unions that the page itself defines."""
    bodies = re.findall(r"(?:struct|union) \w*\s*\{(.*?)\}", "\n".join(block.text for block in page.blocks), flags=re.S)
    return {field for body in bodies for field in re.findall(r"(\w+)(?:\[\w+\])*;", without_comments(body))}


def check_block(page, block, names):
    fields = names.fields | own_fields(page)
    code = re.sub(r"#include[^\n]*|/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\n])*\"",
                  lambda m: blank(m.group(0)), block.text, flags=re.S)
    for offset, line in enumerate(code.split("\n")):
        where = f"{page.path}:{block.line + offset}"
        for name in NAME.findall(line):
            known = names.all if block.language == "glsl" else names.public
            yield name if names.unknown(name, known) else None, f"{where}: the headers have no '{name}'"
        if block.language == "c":
            for designator, member in MEMBER.findall(line):
                field = designator or member
                yield field if field not in fields else None, f"{where}: no struct of the headers has '{field}'"


def is_free(page, line):
    """Returns whether prose there may have names that do not exist."""
    return page.is_of_earlier_versions(line) or page.section_of(line) == EXAMPLES


def check_prose(page, names):
    for line, text in page.spans():
        if is_free(page, line):
            continue
        where = f"{page.path}:{line}"
        for name in NAME.findall(text):
            yield name if names.unknown(name, names.all) else None, f"{where}: nothing is called '{name}'"
        for struct, field in IN_STRUCT.findall(text):
            wrong = struct in names.structs and field not in names.structs[struct]
            yield field if wrong else None, f"{where}: {struct} has no '{field}'"
    for match in OF_STRUCT.finditer(page.prose):
        line = page.prose.count("\n", 0, match.start()) + 1
        field, struct = match.groups()
        if not is_free(page, line) and struct in names.structs:
            wrong = field not in names.structs[struct]
            yield field if wrong else None, f"{page.path}:{line}: {struct} has no '{field}'"


def check(root):
    """Problems, and the number of names."""
    root = pathlib.Path(root)
    names = Names(root)
    results = []
    for page in pages(root):
        for block in page.blocks:
            if block.language in CODE:
                results += check_block(page, block, names)
        results += check_prose(page, names)
    return list(dict.fromkeys(text for wrong, text in results if wrong)), len(results)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    report("names of the API", *check(sys.argv[1]))
