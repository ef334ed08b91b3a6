"""Every command of the programs in the documents has flags that exist and values that parse.

A program's --help lists its flags. The program itself also parses each command in a block. cumulet-render and
cumulet-merge run in a folder without the named volumes and models, where a correct command ends with status 1. The other
programs get --help after the command's words. Commands within prose may have placeholders, so only their flags count.
A block that is a scene file is read by cumulet-render.

usage: commands.py ROOT PROGRAM...
"""

import pathlib
import re
import subprocess
import sys
import tempfile

from pages import block_commands, pages, report, span_commands
import source_tree

RENDER, FARM, BENCH = "cumulet-render", "cumulet-farm", "cumulet-bench"
RUN_WITHOUT_FILES = (RENDER, "cumulet-merge")
SCENE = '{ "cumulet_scene": 3, "volumes": [ { "file": "none.vdb" } ] }\n'
SECONDS = 120


class Program:
    def __init__(self, path):
        self.path = path
        self.name = pathlib.Path(path).name
        text = subprocess.run([path, "--help"], check=True, capture_output=True, text=True, timeout=SECONDS).stdout
        # The first column: "-o,--output FILE", "--spp N".
        spellings = re.findall(r"^ {2,}(-{1,2}[A-Za-z][\w-]*(?:, ?-{1,2}[A-Za-z][\w-]*)*)", text, flags=re.M)
        self.flags = {flag for group in spellings for flag in re.split(r", ?", group)}
        if not self.flags:
            sys.exit(f"{path} --help lists no flag")

    def has(self, flag):
        """Returns whether the flag exists, or at least one flag that matches `--gltf-*`."""
        if flag.endswith("*"):
            return any(known.startswith(flag[:-1]) for known in self.flags)
        return flag in self.flags


def flags_of(words):
    """The flags among a command's words, without values that begin with a minus sign."""
    return [word.split("=")[0] for word in words if re.match(r"--?[A-Za-z]", word)]


def parts_of(command):
    """A command as (program, words) pairs: words after -- of cumulet-farm go to cumulet-render."""
    name, words = command.text[0].rsplit("/", 1)[-1], command.text[1:]
    if name == FARM and "--" in words:
        split = words.index("--")
        return [(name, words[:split]), (RENDER, words[split + 1:] + ["-o", "frame.####.exr"])]
    return [(name, words)]


def parse(program, words):
    """The line with which the program refuses the words, or None."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = list(words)
        for word in arguments:
            if word.endswith(".json") and "/../" not in word and not word.startswith("/"):
                scene = pathlib.Path(folder) / word
                scene.parent.mkdir(parents=True, exist_ok=True)
                scene.write_text(SCENE)
        runs = program.name in RUN_WITHOUT_FILES
        done = subprocess.run([program.path, *arguments, *([] if runs else ["--help"])], cwd=folder, timeout=SECONDS,
                              capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode == (1 if runs else 0):
            return None
        return f"status {done.returncode}: {(done.stderr.strip() or 'no line on standard error').splitlines()[-1]}"


def check_flags(command, programs):
    for name, words in parts_of(command):
        for flag in flags_of(words):
            if name in programs and not programs[name].has(flag):
                yield f"{command.page}:{command.line}: {name} has no {flag}"


def check_parsing(command, programs):
    for name, words in parts_of(command):
        if name in programs and name != BENCH:
            refusal = parse(programs[name], words)
            if refusal:
                yield f"{command.page}:{command.line}: {name} {' '.join(words)}: {refusal}"


def check_scene(page, block, program):
    """Yields a problem if a block is a scene file that the program cannot read."""
    if re.match(r"\s*\{\s*\"cumulet_scene\"", block.text):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "scene.json"
            scene.write_text(block.text)
            done = subprocess.run([program.path, "--scene", str(scene), "--help"], timeout=SECONDS, capture_output=True,
                                  text=True, stdin=subprocess.DEVNULL)
            yield done.stderr.replace(str(scene), f"{page.path}:{block.line}").strip() if done.returncode else None


def other_flags(root):
    """Flags of scripts and test programs, which have no --help here."""
    found = set()
    for path in source_tree.files(root):
        if re.match(r"(?:tests|cmake|scripts|\.ci)/|demo/(?:embed|farm)/|CMakePresets", path) and not path.endswith((".md", ".exr")):
            found |= set(re.findall(r"--[a-z][a-z-]*\b", (root / path).read_text(encoding="utf-8", errors="ignore")))
    return found


def check(root, paths):
    """Problems, and the number of commands and single flags."""
    root = pathlib.Path(root)
    programs = {program.name: program for program in map(Program, paths)}
    elsewhere = other_flags(root)
    problems, checked = [], 0
    for page in pages(root):
        in_blocks = list(block_commands(page, list(programs)))
        in_prose = [c for c in span_commands(page, list(programs)) if not page.is_of_earlier_versions(c.line)]
        for command in in_blocks + in_prose:
            wrong = list(check_flags(command, programs))
            if not wrong and command in in_blocks:
                wrong = list(check_parsing(command, programs))
            problems += wrong
            checked += 1
        for block in page.blocks if RENDER in programs else []:
            read = list(check_scene(page, block, programs[RENDER]))
            problems += filter(None, read)
            checked += len(read)
        for line, text in page.spans():
            flag = re.match(r"--[a-z][a-z-]*\*?", text)
            if not flag or page.is_of_earlier_versions(line):
                continue
            checked += 1
            if not any(p.has(flag.group(0)) for p in programs.values()) and flag.group(0) not in elsewhere:
                problems.append(f"{page.path}:{line}: no program has {flag.group(0)}")
    return problems, checked


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    report("commands and flags", *check(sys.argv[1], sys.argv[2:]))
