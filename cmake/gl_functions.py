"""Lists the OpenGL functions that sources call, as lines of CUMULET_GL_FUNCTION(Name).

A function counts as called if its name follows ".", "->" or "::" in code.

Usage: gl_functions.py --out FILE --table GLAD_HEADER SOURCE..."""

import argparse
import re
import sys
from pathlib import Path

MEMBER = re.compile(r"^ +PFNGL\w+PROC (\w+);", re.MULTILINE)
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
CALL = re.compile(r"(?:\.|->|::)([A-Z]\w*)")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--table", type=Path, required=True)
    parser.add_argument("sources", type=Path, nargs="+")
    options = parser.parse_args()
    table = MEMBER.findall(options.table.read_text())
    called = set()
    for source in options.sources:
        called.update(CALL.findall(COMMENT.sub("", source.read_text())))
    names = [name for name in table if name in called]
    if not names:
        sys.exit(f"gl_functions.py: {options.table} has no function that the sources call")
    text = "".join(f"CUMULET_GL_FUNCTION({name})\n" for name in names)
    if not options.out.exists() or options.out.read_text() != text:
        options.out.write_text(text)


if __name__ == "__main__":
    main()
