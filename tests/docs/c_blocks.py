"""Writes the C blocks of a page as a C file. Errors of the compiler name the page and its line.

usage: c_blocks.py PAGE OUT.c --whole [--replace OLD NEW]...
       c_blocks.py PAGE OUT.c --within DECLARATIONS.h
       c_blocks.py PAGE OUT --block TEXT

--whole: the blocks, in their order, are one source file. --replace changes a text of the blocks, which must occur once.
--within: each block is the body of a scope of one function, inside the scope of the block before it, so that it sees the
names that earlier blocks declare. The header declares the reader's own names.
--block: the first block of any language that begins with a text.
"""

import argparse
import pathlib
import sys

from pages import Page


def with_lines(page, block):
    return f'#line {block.line} "{page.path}"\n{block.text}\n'


def whole(page, blocks, replacements):
    text = "".join(with_lines(page, block) for block in blocks)
    for old, new in replacements:
        if text.count(old) != 1:
            sys.exit(f"{page.path}: '{old}' occurs {text.count(old)} times, not once")
        text = text.replace(old, new)
    return text


def within(page, blocks, header):
    parts = [f'#include "{header.name}"\n\nvoid {header.stem}_page(void);\nvoid {header.stem}_page(void) {{\n']
    parts += [with_lines(page, block) + "{\n" for block in blocks]
    return "".join(parts) + "}" * (len(blocks) + 1) + "\n"


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n\n")[0])
    parser.add_argument("page", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    mode = parser.add_mutually_exclusive_group(required=True)
    mode.add_argument("--whole", action="store_true")
    mode.add_argument("--within", type=pathlib.Path)
    mode.add_argument("--block")
    parser.add_argument("--replace", nargs=2, action="append", default=[])
    arguments = parser.parse_args()
    page = Page(str(arguments.page), arguments.page.read_text(encoding="utf-8"))
    blocks = [b for b in page.blocks if (b.text.startswith(arguments.block) if arguments.block else b.language == "c")]
    if not blocks:
        sys.exit(f"{page.path}: there is no such block")
    if arguments.block:
        text = blocks[0].text + "\n"
    elif arguments.within:
        text = within(page, blocks, arguments.within)
    else:
        text = whole(page, blocks, arguments.replace)
    arguments.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
