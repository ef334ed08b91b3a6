"""Reads the declarations of cumulet.h for the generators. It understands only that header's style."""
import collections
import re

# A function, or the type of a callback. doc: its comment without tags.
Function = collections.namedtuple("Function", "name result parameters doc")
# A member of a struct, or a parameter. length: of an array, as written; None if it is no array.
Member = collections.namedtuple("Member", "name type length doc")
Struct = collections.namedtuple("Struct", "name members doc")
# constants: (name, value, doc).
Enum = collections.namedtuple("Enum", "name constants doc")
Handle = collections.namedtuple("Handle", "name doc")

COMMENT = re.compile(r"/\*(.*?)\*/", re.S)
MARK = "\x01"
DECLARATION = re.compile(
    rf"(?:{MARK}(?P<doc>\d+){MARK}\s*)?(?:"
    rf"typedef struct (?P<struct>\w+) \{{(?P<members>[^{{}}]*)\}} (?P=struct);"
    rf"|typedef enum (?P<enum>\w+) \{{(?P<constants>[^{{}}]*)\}} (?P=enum);"
    rf"|enum \{{(?P<unnamed>[^{{}}]*)\}};"
    rf"|typedef struct (?P<handle>\w+) (?P=handle);(?: *{MARK}(?P<after>\d+){MARK})?"
    rf"|typedef (?P<callback_result>[\w ]+?\**) ?\(\*(?P<callback>\w+)\)\((?P<callback_parameters>[^()]*)\);"
    rf"|CUMULET_API (?P<result>[\w ]+?\**) (?P<function>\w+)\((?P<parameters>[^()]*)\);)")


def read(path):
    with open(path, encoding="utf-8") as file:
        return re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)


def types(kind, text):
    """Returns the name and the body of each `typedef struct` or `typedef enum`, in order."""
    return re.findall(rf"typedef {kind} (\w+) \{{(.*?)\}} \1;", text, flags=re.S)


# --- comments --------------------------------------------------------------------------------------------------------

def plain(comment):
    """The lines of a comment, without its stars."""
    body = comment.lstrip("*").removeprefix("<")
    return "\n".join(re.sub(r"^\s*\* ?", "", line).rstrip() for line in body.split("\n")).strip()


def sections(doc):
    """The description of a function, its parameters {name: text}, and its result."""
    parts = re.split(r"^@(param\s+\w+|return)\s*", doc, flags=re.M)
    tagged = {tag.split()[-1]: re.sub(r"\n\s+", "\n", text).strip() for tag, text in zip(parts[1::2], parts[2::2])}
    return parts[0].strip(), tagged, tagged.pop("return", "")


def common_prefix(names):
    """The longest prefix of all names that ends in `_`."""
    prefix = names[0]
    while not all(name.startswith(prefix) for name in names) or not prefix.endswith("_"):
        prefix = prefix[:-1]
    return prefix


class Header:
    """The declarations of a header, in order."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            text = file.read()
        self.comments = []
        self.text = COMMENT.sub(self.marked, text)
        found = re.search(r"CUMULET_VERSION_MAJOR (\d+)\s+#define CUMULET_VERSION_MINOR (\d+)", self.text)
        self.version = found.groups() if found else None
        self.declarations = [self.declaration(match) for match in DECLARATION.finditer(self.text)]

    def of(self, kind):
        return [one for one in self.declarations if isinstance(one, kind)]

    def marked(self, match):
        self.comments.append(match.group(1))
        return f"{MARK}{len(self.comments) - 1}{MARK}"

    def doc(self, number):
        return plain(self.comments[int(number)]) if number else ""

    def declaration(self, match):
        doc = self.doc(match["doc"])
        if match["struct"]:
            return Struct(match["struct"], [self.member(*one) for one in self.items(match["members"], ";")], doc)
        if match["enum"]:
            return Enum(match["enum"], self.constants(match["constants"]), doc)
        if match["unnamed"]:
            return Enum(None, self.constants(match["unnamed"]), doc)
        if match["handle"]:
            return Handle(match["handle"], doc or self.doc(match["after"]))
        kind = "callback" if match["callback"] else "function"
        result = match["callback_result"] if match["callback"] else match["result"]
        parameters = match["callback_parameters"] if match["callback"] else match["parameters"]
        _, tagged, _ = sections(doc)
        members = [self.member(" ".join(one.split()), "") for one in parameters.split(",") if one.strip() != "void"]
        return Function(match[kind], result, [m._replace(doc=tagged.get(m.name, "")) for m in members], doc)

    def items(self, body, separator):
        """(declaration, comment) of each item. A comment belongs to the item before it if it begins with `<`."""
        items, pending = [], ""
        for mark, text in re.findall(rf"{MARK}(\d+){MARK}|([^{MARK}{separator}]+)", body):
            if text.strip():
                items.append([" ".join(text.split()), pending])
                pending = ""
            elif mark and self.comments[int(mark)].startswith("*<"):
                items[-1][1] = self.doc(mark)
            elif mark:
                pending = self.doc(mark)
        return items

    def constants(self, body):
        return [(*(part.strip() for part in text.split("=")), doc) for text, doc in self.items(body, ",")]

    @staticmethod
    def member(text, doc):
        match = re.fullmatch(r"(.*?[\s*])(\w+)((?:\[\w+\])*)", text)
        return Member(match[2], match[1].strip(), match[3].strip("[]") or None, doc)
