"""Write a program's manual page and its completions for bash and zsh, from the program's own table of options.

`PROGRAM --option-table` prints the flags (format: demo/render/option_table.hpp). The page is a template with the fields
@synopsis@, @about@, @options@, @exit_status@ and @notes@.
"""
import argparse
import pathlib
import re
import subprocess
import sys


class Option:
    def __init__(self, kind, group, spellings, type_, required, help_):
        self.positional = kind == "argument"
        self.group, self.spellings, self.help = group, spellings.split(","), help_
        self.repeats = type_.endswith("...")
        self.type = type_.removesuffix("...").strip()
        self.required = required == "required"

    def choices(self):
        """Returns the words that the option accepts, if its type lists them: tet|dense|brick, or K|auto."""
        return [w for w in self.type.split("|") if "|" in self.type and re.fullmatch(r"[a-z][a-z0-9-]*", w)]

    def patterns(self):
        """Returns patterns for the files that the option accepts, by the suffixes in its type or its help; nothing if
        it takes no file."""
        if not self.type.startswith("FILE"):
            return []
        endings = re.findall(r"(?<!\w)\.([a-z0-9]+)\b", self.type.replace("FILE", "") + " " + self.help)
        return [f"*.{e}" for e in dict.fromkeys(endings)] or ["*"]


def read_table(program):
    about, footer, options = "", [], []
    table = subprocess.run([program, "--option-table"], check=True, capture_output=True, text=True).stdout
    for line in table.splitlines():
        kind, *fields = line.split("\t")
        if kind == "about":
            about = fields[0]
        elif kind == "footer":
            footer.append(fields[0])
        else:
            options.append(Option(kind, *fields))
    if not options:
        sys.exit(f"{program} --option-table names no option")
    return about, footer, options


# --- the manual page -------------------------------------------------------------------------------------------------

def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("^", "\\(ha").replace("~", "\\(ti")
    return re.sub(r"^\.", r"\\&.", text)


def roff_spelling(option):
    value = f" \\fI{roff(option.type)}\\fR" if option.type else ""
    if option.positional:
        return "\\fI" + roff(option.spellings[0]) + "\\fR"
    return ", ".join(f"\\fB{roff(s)}\\fR" for s in option.spellings) + value


def roff_synopsis(program, options):
    words = [f"\\fB{roff(program)}\\fR", "[\\fIOPTION\\fR]..."]
    for option in options:
        if not option.positional and option.required:
            words.append(f"\\fB{roff(option.spellings[0])}\\fR \\fI{roff(option.type)}\\fR")
    for option in options:
        if option.positional:
            name = roff_spelling(option)
            words.append((name if option.required else f"[{name}]") + ("..." if option.repeats else ""))
    return " ".join(words)


def roff_options(options):
    # The options that every program has come last.
    groups = sorted(dict.fromkeys(o.group for o in options), key=lambda g: g == "Options")
    parts = [("Arguments", [o for o in options if o.positional])]
    parts += [(g, [o for o in options if o.group == g and not o.positional]) for g in groups]
    lines = []
    for group, members in parts:
        if members:
            lines.append(f'.SS "{roff(group)}"')
        for option in members:
            lines += [".TP", roff_spelling(option), roff(option.help.removesuffix(".") + ".")]
    return "\n".join(lines)


def roff_statuses(footer):
    """Formats lines such as "Exit status: 0 done; 1 failed, and why; 2 wrong usage." as a list."""
    lines = []
    for line in footer:
        for part in line.removeprefix("Exit status: ").removesuffix(".").split("; "):
            status, _, meaning = part.partition(" ")
            lines += [".TP", f"\\fB{status}\\fR", roff(meaning[0].upper() + meaning[1:] + ".")]
    return "\n".join(lines)


def manual_page(template, program, version, about, footer, options):
    status = [line for line in footer if line.startswith("Exit status: ")]
    filled = {
        "version": version,
        "synopsis": roff_synopsis(program, options),
        "about": roff(about),
        "options": roff_options(options),
        "exit_status": roff_statuses(status),
        "notes": "\n.br\n".join(roff(line) for line in footer if line not in status),
    }
    return re.sub(r"@(\w+)@", lambda m: filled[m.group(1)], template)


# --- completions -----------------------------------------------------------------------------------------------------

BASH = """# bash completion for {program}
{function}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}} words='' pattern
  local -a patterns=()
  COMPREPLY=()
  # "--flag=value" comes as three words.
  if [[ $cur == "=" ]]; then
    cur=''
  elif [[ $prev == "=" ]]; then
    prev=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  case $prev in
{cases}
    *)
      if [[ $cur == -* ]]; then
        words="{flags}"
      else
        {positional}
      fi
      ;;
  esac
  if [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$cur")
  elif ((${{#patterns[@]}})); then
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(
      compgen -d -- "$cur"
      for pattern in "${{patterns[@]}}"; do compgen -f -X "!$pattern" -- "$cur"; done | sort -u
    )
  fi
}} && complete -F {function} {program}
"""


def quoted(words):
    return " ".join("'" + w.replace("'", "'\\''") + "'" for w in words)


def bash_value(option):
    if option.choices():
        return f'words="{" ".join(option.choices())}"'
    if option.type == "DIR":
        return "patterns=('*/')"  # folders only
    return f"patterns=({quoted(option.patterns())})" if option.patterns() else ":"


def bash_completion(program, options):
    cases = []
    for option in options:
        if not option.positional and option.type:
            cases.append(f"    {' | '.join(option.spellings)}) {bash_value(option)} ;;")
    positional = next((bash_value(o) for o in options if o.positional), ":")
    flags = " ".join(s for o in options if not o.positional for s in o.spellings)
    return BASH.format(program=program, function="_" + program.replace("-", "_"), cases="\n".join(cases), flags=flags,
                       positional=positional)


def zsh_action(option):
    if option.choices():
        return "(" + " ".join(option.choices()) + ")"
    if option.type == "DIR":
        return "_files -/"
    patterns = option.patterns()
    if not patterns:
        return " "
    return "_files" if patterns == ["*"] else f'_files -g "{" ".join(patterns)}"'


def zsh_completion(program, options):
    def message(text):
        return text.replace("\\", "\\\\").replace(":", "\\:")

    specs = []
    for option in options:
        value = f":{message(option.type)}:{zsh_action(option)}" if option.type else ""
        if option.positional:
            specs.append(quoted([("*" if option.repeats else "") + (":" if option.required or option.repeats else "::")
                                 + message(option.type) + ":" + zsh_action(option)]))
            continue
        help_ = "[" + option.help.replace("\\", "\\\\").replace("[", "\\[").replace("]", "\\]") + "]"
        spellings = [s + ("=" if value and s.startswith("--") else "") for s in option.spellings]
        if option.repeats:
            specs.append(quoted(["*" + spellings[0] + help_ + value]))
        elif len(spellings) > 1:
            specs.append(quoted([f"({' '.join(option.spellings)})"]) + "{" + ",".join(spellings) + "}"
                         + quoted([help_ + value]))
        else:
            specs.append(quoted([spellings[0] + help_ + value]))
    return f"#compdef {program}\n_arguments -S \\\n  " + " \\\n  ".join(specs) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("template", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("version")
    arguments = parser.parse_args()
    name = arguments.program.name
    about, footer, options = read_table(arguments.program)
    page = manual_page(arguments.template.read_text(), name, arguments.version, about, footer, options)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / f"{name}.1").write_text(page)
    (arguments.out / f"{name}.bash").write_text(bash_completion(name, options))
    (arguments.out / f"{name}.zsh").write_text(zsh_completion(name, options))


if __name__ == "__main__":
    main()
