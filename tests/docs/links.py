"""Every internal link, heading anchor and path of a repository file in the documents leads to something.

usage: links.py [--links-only] ROOT
--links-only: without paths in code spans, for installed pages.
"""

import os
import pathlib
import re
import sys
import urllib.parse

from pages import pages, report
import source_tree

LINK = re.compile(r"\[[^\]]*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)|^ {0,3}\[[^\]]+\]:\s+(\S+)", re.M)
FOLDERS = "cmake|demo|docs|glsl|python|scripts|src|tests|third_party_notes"
PATH = re.compile(rf"(?:{FOLDERS})/[\w./*-]*")


def check(root, with_paths=True):
    """Problems, and the number of links and paths."""
    root = pathlib.Path(root)
    files = source_tree.files(root)
    known = {page.path: page for page in pages(root)}
    problems, checked = [], 0
    for page in known.values():
        for match in LINK.finditer(page.prose_without_code):
            target = match.group(1) or match.group(2)
            if re.match(r"[a-z]+:", target):
                continue
            checked += 1
            line = page.prose.count("\n", 0, match.start()) + 1
            name, _, anchor = urllib.parse.unquote(target).partition("#")
            path = os.path.normpath(os.path.join(os.path.dirname(page.path), name)) if name else page.path
            if not (root / path).exists() or path.startswith(".."):
                problems.append(f"{page.path}:{line}: link to '{target}': there is no '{path}'")
            elif anchor and anchor not in (known[path].anchors() if path in known else ()):
                problems.append(f"{page.path}:{line}: link to '{target}': '{path}' has no such heading")
        for line, text in page.spans():
            if not with_paths or not PATH.fullmatch(text):
                continue
            checked += 1
            path = text.rstrip("/")
            if not any(pathlib.PurePath(f).match(path) or f.startswith((path + "/", path + ".")) for f in files):
                problems.append(f"{page.path}:{line}: there is no '{path}'")
    return problems, checked


if __name__ == "__main__":
    words = sys.argv[1:]
    links_only = words[:1] == ["--links-only"]
    if len(words) != 1 + links_only:
        sys.exit(__doc__)
    report("links" if links_only else "links and paths", *check(words[-1], not links_only))
