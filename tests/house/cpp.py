"""Finds the classes, functions, includes and strings of a C++, C or GLSL file, without a compiler.

The parser separates tokens, drops comments and directives, and then follows declarations by their brackets. It expands
no macro and resolves no name. It relies on clang-format only to distinguish `&&` of a type from the operator.
"""

import collections
import re

Token = collections.namedtuple("Token", "kind text line is_spaced")  # is_spaced: white space precedes the token
Include = collections.namedtuple("Include", "line name")
# full_name: with namespaces.
Function = collections.namedtuple("Function", "name full_name line lines complexity")


class ParseError(Exception):
    """Brackets that do not match, or another token in place of one."""


class Class:
    """A class, struct or union. members: the names of its own data members that are not static."""

    def __init__(self, name, line):
        self.name, self.line, self.members = name, line, []


# --- tokens ----------------------------------------------------------------------------------------------------------

TOKEN = re.compile(r"""
    (?P<space>(?:\s|\\\n)+)
  | (?P<comment>//(?:\\\n|[^\n])*|/\*.*?\*/)
  | (?P<raw>(?:u8|[uUL])?R"(?P<tag>[^\s()\\]{0,16})\(.*?\)(?P=tag)")
  | (?P<string>(?:u8|[uUL])?"(?:\\.|[^"\\\n])*")
  | (?P<character>(?:u8|[uUL])?'(?:\\.|[^'\\\n])*')
  | (?P<number>\.?\d(?:[eEpP][+-]|'?[\w.])*)
  | (?P<name>[A-Za-z_$][\w$]*)
  | (?P<mark>::|->\*?|<=>|<<=?|<=|&&|\|\||\+\+|--|[-+*/%&|^!=]=|\.\.\.|\#\#|.)""", re.S | re.X)
DIRECTIVE = re.compile(r"#(?:/\*.*?\*/|//[^\n]*|\\\n|[^\n])*", re.S)
INCLUDE = re.compile(r"#\s*include\s*[<\"]([^>\"]+)")
CONDITION = re.compile(r"#\s*(if|ifdef|ifndef|elif|elifdef|elifndef|else|endif)\b\s*(.*)", re.S)
OPENING = {"(": ")", "[": "]", "{": "}"}
CLOSING = frozenset(OPENING.values())


def is_balanced(tokens):
    depth = 0
    for token in tokens:
        if token.kind == "mark" and token.text in OPENING:
            depth += 1
        elif token.kind == "mark" and token.text in CLOSING:
            depth -= 1
            if depth < 0:
                return False
    return depth == 0


class Conditions:
    """Collects tokens. Branches of #if and #else are all kept if their brackets match, else only the first one.

    The branch of `#if 0` is dropped.
    """

    def __init__(self):
        self.groups = [[[]]]  # the open conditions, each with its branches
        self.dropped = [False]  # for each, whether its first branch is dropped

    def add(self, token):
        self.groups[-1][-1].append(token)

    def directive(self, kind, condition):
        if kind.startswith("if"):
            self.groups.append([[]])
            self.dropped.append(condition.strip() == "0")
        elif len(self.groups) == 1:
            return
        elif kind != "endif":
            self.groups[-1].append([])
        else:
            branches = self.groups.pop()[self.dropped.pop():]
            kept = branches if all(is_balanced(branch) for branch in branches) else branches[:1]
            self.groups[-1][-1].extend(token for branch in kept for token in branch)

    def tokens(self):
        while len(self.groups) > 1:
            self.directive("endif", "")
        return self.groups[0][0]


def tokens_of(text):
    """The tokens of the code, without comments and directives, and the includes."""
    conditions, includes = Conditions(), []
    position, line, is_spaced, starts_line = 0, 1, True, True
    while position < len(text):
        match = DIRECTIVE.match(text, position) if starts_line and text[position] == "#" else None
        if match:
            include, condition = INCLUDE.match(match.group(0)), CONDITION.match(match.group(0))
            if include:
                includes.append(Include(line, include.group(1)))
            if condition:
                conditions.directive(condition.group(1), condition.group(2))
            kind = "directive"
        else:
            match = TOKEN.match(text, position)
            kind = match.lastgroup
        token = match.group(0)
        if kind in ("space", "comment", "directive"):
            is_spaced = True
            starts_line = starts_line or "\n" in token
        else:
            conditions.add(Token("string" if match.group("raw") else kind, token, line, is_spaced))
            is_spaced = starts_line = False
        line += token.count("\n")
        position = match.end()
    return conditions.tokens(), includes


def matches_of(tokens):
    """For each opening bracket the index of the closing one."""
    open_ones, matches = [], {}
    for index, token in enumerate(tokens):
        if token.kind != "mark":
            continue
        if token.text in OPENING:
            open_ones.append(index)
        elif token.text in CLOSING:
            if not open_ones or OPENING[tokens[open_ones[-1]].text] != token.text:
                raise ParseError(f"line {token.line}: '{token.text}' closes no bracket")
            matches[open_ones.pop()] = index
    if open_ones:
        raise ParseError(f"line {tokens[open_ones[-1]].line}: '{tokens[open_ones[-1]].text}' is not closed")
    return matches


# --- complexity ------------------------------------------------------------------------------------------------------

DECISIONS = frozenset("if for while case catch and or && || ?".split())


def is_reference(tokens, index):
    """True if `&&` belongs to a type: no white space precedes it, and no operand follows it directly."""
    after = tokens[index + 1]
    return not tokens[index].is_spaced and (after.is_spaced or after.text in (")", ">", ",", "..."))


def complexity_of(tokens, begin, end):
    """Cyclomatic complexity: one, and one per decision."""
    return 1 + sum(tokens[i].text in DECISIONS and not (tokens[i].text == "&&" and is_reference(tokens, i))
                   for i in range(begin, end))


# --- declarations ----------------------------------------------------------------------------------------------------

CLASS_KEYS = ("class", "struct", "union")
ACCESS = ("public", "protected", "private", "signals", "Q_SIGNALS")
WITH_GROUP = ("alignas", "decltype", "explicit", "noexcept", "throw", "typeof", "__attribute__", "__declspec")
AFTER_PARAMETERS = ("const", "volatile", "override", "final", "mutable", "noexcept", "throw", "&", "&&", "alignas",
                    "__attribute__", "constexpr")
AFTER_NAME = (*AFTER_PARAMETERS, "requires", "try")
NOT_MEMBERS = ("static", "friend", "typedef", "extern")
SPECIFIERS = ("const", "volatile", "mutable", "inline", "constexpr", "typename", "virtual", "thread_local")
TYPE_WORDS = frozenset("bool char short int long float double unsigned signed void auto wchar_t char8_t char16_t "
                       "char32_t".split())
POINTERS = ("*", "&", "&&", "^")
BEGINNINGS = ("namespace", "using", "template", "static_assert")
MACRO = re.compile(r"[A-Z][A-Z0-9_]+")


class Parser:
    """Finds classes and functions. namespaces, classes: the names of those around a declaration. owner: its class."""

    def __init__(self, tokens):
        self.tokens, self.matches = tokens, matches_of(tokens)
        self.classes, self.functions = [], []
        self.declarations = set()  # full names of functions
        self.scope(0, len(tokens), (), (), None)

    def text(self, index):
        """The text of a token of code; of a string, character or end of file something that equals no token."""
        if index >= len(self.tokens):
            return "end of file"
        return self.tokens[index].text if self.tokens[index].kind in ("name", "mark", "number") else "a literal"

    def is_name(self, index):
        return index < len(self.tokens) and self.tokens[index].kind == "name"

    def after_group(self, index):
        """The index after a bracketed group."""
        if index not in self.matches:
            raise ParseError(f"line {self.tokens[min(index, len(self.tokens) - 1)].line}: a bracket is expected")
        return self.matches[index] + 1

    def after_optional_group(self, index):
        return self.after_group(index) if self.text(index) == "(" else index

    def after_angles(self, index):
        """The index after template arguments that begin at `index`, or None if `<` is an operator."""
        depth = 0
        while index < len(self.tokens):
            text = self.text(index)
            if text in OPENING:
                index = self.matches[index]
            elif text == "<":
                depth += 1
            elif text == ">":
                depth -= 1
                if depth == 0:
                    return index + 1
            elif text in CLOSING or text == ";":
                return None
            index += 1
        return None

    def skip_until(self, index, end, stops):
        """The index of the first of these marks outside of brackets and template arguments, or `end`."""
        while index < end and self.text(index) not in stops:
            if self.text(index) in OPENING:
                index = self.after_group(index)
            elif self.text(index) == "<" and index > 0 and self.is_name(index - 1):
                index = self.after_angles(index) or index + 1
            else:
                index += 1
        return min(index, end)

    def after_qualified_name(self, index):
        """The index after a name with its scopes and template arguments."""
        while True:
            index += self.text(index) == "::"
            index += 1
            if self.text(index) == "<":
                index = self.after_angles(index) or index + 1
            if self.text(index) != "::":
                return index

    def after_constraint(self, index):
        """The index after a requires-clause, whose operands are names, parentheses and requires-expressions."""
        index += 1
        while True:
            while self.text(index) == "!":
                index += 1
            if self.text(index) == "requires":
                index = self.after_group(self.after_optional_group(index + 1))
            elif self.text(index) == "(":
                index = self.after_group(index)
            else:
                index = self.after_qualified_name(index)
            if self.text(index) not in ("&&", "||", "and", "or"):
                return index
            index += 1

    def scope(self, index, end, namespaces, classes, owner):
        """Parses the declarations of a file, namespace or class."""
        while index < end:
            index = self.declaration(index, end, namespaces, classes, owner)

    def declaration(self, index, end, namespaces, classes, owner):
        """Parses a declaration and returns the index after it."""
        begin = index
        while self.text(index) == "template" and self.text(index + 1) == "<":
            index = self.after_angles(index + 1) or end
            if self.text(index) == "requires":
                index = self.after_constraint(index)
        text, after = self.text(index), self.text(index + 1)
        if text in ACCESS and (after == ":" or self.text(index + 2) == ":"):
            return index + (2 if after == ":" else 3)
        if text == "namespace":
            return self.namespace(index, end, namespaces, classes)
        if text == "extern" and after == "a literal":
            if self.text(index + 2) == "{":
                self.scope(index + 3, self.matches[index + 2], namespaces, classes, owner)
                return self.after_group(index + 2)
            index += 2
        if self.text(index) in ("using", "static_assert", "concept"):
            return self.skip_until(index, end, (";",)) + 1
        if text == "{":
            return self.after_group(index)
        return Declaration(self, begin, index, end, namespaces, classes, owner).parse()

    def namespace(self, index, end, namespaces, classes):
        names = []
        while index < end and self.text(index) not in ("{", ";", "="):
            if self.text(index) == "[":
                index = self.after_group(index)
                continue
            if self.is_name(index) and self.text(index) not in ("namespace", "inline"):  # as in namespace a::inline b
                names.append(self.text(index))
            index += 1
        if self.text(index) != "{":
            return self.skip_until(index, end, (";",)) + 1
        self.scope(index + 1, self.matches[index], (*namespaces, *names), classes, None)
        return self.after_group(index)

    def class_head(self, index):
        """The name ("" if there is none) and the index of the brace of a class that is defined at `index`, or None."""
        name, index = "", index + 1
        while True:
            text = self.text(index)
            if text == "{":
                return name, index
            if text == ":":
                index = self.skip_until(index, len(self.tokens), ("{", ";", ")"))
                return (name, index) if self.text(index) == "{" else None
            if text == "[" and self.text(index + 1) == "[":
                index = self.after_group(index)
            elif text in WITH_GROUP or (MACRO.fullmatch(name) and text == "("):
                index = self.after_optional_group(index + (text != "("))
            elif text == "final" and self.text(index + 1) in ("{", ":"):
                index += 1
            elif text == "::":
                name, index = name + text, index + 1
            elif text == "<" and name:
                after = self.after_angles(index)
                if after is None:
                    return None
                name, index = name + "".join(self.text(i) for i in range(index, after)), after
            elif self.is_name(index) and (not name or name.endswith("::")):
                name, index = name + text, index + 1
            elif self.is_name(index) and MACRO.fullmatch(name):
                name, index = text, index + 1
            else:
                return None

    def parse_class(self, name, brace, namespaces, classes):
        """Parses the body of a class, and returns the class."""
        inner = (*classes, name) if name else classes
        found = Class("::".join((*namespaces, *inner)), self.tokens[brace].line)
        self.classes.append(found)
        self.scope(brace + 1, self.matches[brace], namespaces, inner, found)
        return found

    def local_classes(self, begin, end, namespaces, classes):
        """Parses the classes that a function's body defines."""
        while begin < end:
            is_class = self.text(begin) in CLASS_KEYS and self.text(begin - 1) != "enum"
            head = self.class_head(begin) if is_class else None
            if head:
                self.parse_class(*head, namespaces, classes)
                begin = self.matches[head[1]]
            begin += 1

    def add_function(self, name, begin, body, end, namespaces, classes):
        """Adds a function. begin: its first token; body: the first token after the parameters; end: after its body."""
        first, last = self.tokens[begin].line, self.tokens[end - 1].line
        self.functions.append(Function("::".join((*classes, name)), "::".join((*namespaces, *classes, name)), first,
                                       last - first + 1, complexity_of(self.tokens, body, end)))
        self.local_classes(body, end, namespaces, (*classes, name))


class Declaration:
    """A declaration of a class, function or variables, from `begin` on. index: after its template parameters."""

    def __init__(self, parser, begin, index, end, namespaces, classes, owner):
        self.parser, self.begin, self.end, self.owner = parser, begin, end, owner
        self.namespaces, self.classes = namespaces, classes
        self.index = self.first = index
        self.counts = True  # its declarators are members
        self.has_type = False  # the next name is a declarator
        self.name = ""  # of the present declarator
        self.unnamed = None  # class without a name, whose declarators may follow

    def parse(self):
        """Returns the index after the declaration."""
        parser = self.parser
        while self.index < self.end:
            text = parser.text(self.index)
            if text == ";":
                self.end_declarator()
                return self.index + 1
            if self.index > self.first and self.is_beginning(text):
                return self.index  # after a macro
            handler = self.HANDLERS.get(text)
            after = handler(self) if handler else self.word(text)
            if after is not None:
                return after
        self.end_declarator()
        return self.end

    def is_beginning(self, text):
        """True if a token can only begin a declaration."""
        if text in ACCESS:
            return ":" in (self.parser.text(self.index + 1), self.parser.text(self.index + 2))
        return text in BEGINNINGS and self.parser.text(self.index - 1) != "::"

    def word(self, text):
        parser = self.parser
        if text in WITH_GROUP:
            self.index = parser.after_optional_group(self.index + 1)
            self.has_type = self.has_type or text in ("decltype", "typeof")
            return
        if text in NOT_MEMBERS:
            self.counts = False
        elif text in TYPE_WORDS:
            self.has_type = True
        elif parser.is_name(self.index) and text not in SPECIFIERS:
            if self.has_type and parser.text(self.index - 1) != "::":
                self.name = text
            self.has_type = True
        self.index += 1

    def end_declarator(self):
        if self.name:
            if self.owner is not None and self.counts:
                self.owner.members.append(self.name)
            if self.unnamed is not None:
                self.unnamed.name = "::".join((*self.namespaces, *self.classes, self.name))
                self.unnamed = None
        elif self.unnamed is not None and self.owner is not None:
            self.owner.members += self.unnamed.members
            self.parser.classes.remove(self.unnamed)
        self.name = ""

    def class_key(self):
        head = self.parser.class_head(self.index)
        if head is None:
            self.index += 1
            return
        found = self.parser.parse_class(*head, self.namespaces, self.classes)
        self.index = self.parser.after_group(head[1])
        self.has_type = True
        self.unnamed = None if head[0] else found

    def enum(self):
        parser, index = self.parser, self.index + 1
        if parser.text(index) in ("class", "struct"):
            index += 1
        while parser.text(index) == "[":
            index = parser.after_group(index)
        if parser.is_name(index):
            index = parser.after_qualified_name(index)
        if parser.text(index) == ":":
            index = parser.skip_until(index, self.end, ("{", ";"))
        if parser.text(index) == "{":
            self.index = parser.after_group(index)
            self.has_type = True
        else:
            self.index += 1

    def comma(self):
        self.end_declarator()
        self.index += 1
        self.has_type = True

    def angles(self):
        self.index = self.parser.after_angles(self.index) or self.index + 1

    def bracket(self):
        self.index = self.parser.after_group(self.index)

    def colon(self):
        self.index = self.parser.skip_until(self.index + 1, self.end, ("=", "{", ",", ";"))

    def brace(self):
        self.index = self.parser.after_group(self.index)

    def equals(self):
        parser, start = self.parser, self.index + 1
        self.index = parser.skip_until(start, self.end, (",", ";"))
        if self.name and parser.text(start) == "[":
            parser.add_function(self.name, self.begin, start, self.index, self.namespaces, self.classes)

    def operator(self):
        parser, index = self.parser, self.index + 1
        if parser.text(index) == "(":
            index = parser.after_group(index)
        while index < self.end and parser.text(index) not in ("(", ";"):
            index += 1
        if parser.text(index) != "(":
            return parser.skip_until(index, self.end, (";",)) + 1
        name = "".join(parser.tokens[i].text + (" " if parser.is_name(i) and parser.is_name(i + 1) else "")
                       for i in range(self.index, index))
        return self.function(self.qualifier(self.index) + name, index)

    def qualifier(self, index):
        """The scopes that a name at `index` is qualified with, as in A<B>::."""
        parser, begin = self.parser, index
        while begin - 2 >= self.first and parser.text(begin - 1) == "::":
            begin = self.before_name(begin - 2)
        return "".join(parser.text(i) for i in range(begin, index))

    def before_name(self, last):
        """The index of the name that ends at `last`, before its template arguments if it has some."""
        parser, depth = self.parser, 0
        while last > self.first:
            depth += (parser.text(last) == ">") - (parser.text(last) == "<")
            if depth == 0 and parser.is_name(last):
                return last
            last -= 1
        return last

    def parenthesis(self):
        parser, open_one, last = self.parser, self.index, self.index - 1
        close = parser.matches[open_one]
        if self.is_pointer(open_one, close):
            star = next(i for i in range(open_one, close) if parser.text(i) in POINTERS)
            name = next((i for i in range(star, close) if parser.is_name(i) and parser.text(i) not in SPECIFIERS), None)
            if name is not None and parser.text(name + 1) == "(" and parser.text(close + 1) == "(":
                return self.function(parser.text(name), close + 1)  # returns a pointer to a function
            self.name = parser.text(name) if name is not None else ""
            self.index = parser.after_optional_group(close + 1)
            return
        if last < self.first or not (parser.is_name(last) or parser.text(last) == ">"):
            self.index = close + 1
            return
        begin = self.before_name(last)
        if self.is_macro(begin, close + 1):
            return close + 1
        tilde = "~" if parser.text(begin - 1) == "~" else ""
        name = self.qualifier(begin - len(tilde)) + tilde + "".join(parser.text(i) for i in range(begin, last + 1))
        if begin == self.first and MACRO.fullmatch(name):
            of = "".join(token.text for token in parser.tokens[open_one + 1:close])
            if parser.text(close + 1) == "{" and parser.text(parser.after_group(close + 1)) == ";":
                parser.parse_class(of, close + 1, self.namespaces, self.classes)
                return parser.after_group(close + 1)
            name += f"({of})"
        return self.function(name, open_one)

    def is_pointer(self, open_one, close):
        """True if parentheses are a declarator, as in `void (*f)(int)` or `void (A::*f)(int)`."""
        parser = self.parser
        if parser.text(open_one + 1) in POINTERS:
            return True
        return parser.text(close + 1) == "(" and any(parser.text(i) == "*" for i in range(open_one, close))

    def is_macro(self, begin, after):
        """True if the parentheses of a name that begins the declaration precede another name."""
        parser = self.parser
        return begin == self.first and parser.is_name(after) and parser.text(after) not in AFTER_NAME

    def function(self, name, open_one):
        """Returns the index after a function. open_one: the index of its parameters."""
        parser, index = self.parser, self.parser.after_group(open_one)
        while index < self.end:
            text = parser.text(index)
            if text in AFTER_PARAMETERS:
                index = parser.after_optional_group(index + 1)
            elif text == "[":
                index = parser.after_group(index)
            elif text == "->":
                index = parser.skip_until(index + 1, self.end, ("{", ";", "=", "requires", "override", "final"))
            elif text == "requires":
                index = parser.after_constraint(index)
            elif text in ("{", ":", "try"):
                after = self.after_body(index)
                parser.add_function(name, self.begin, index, after, self.namespaces, self.classes)
                return after
            elif parser.is_name(index):  # a macro
                index = parser.after_optional_group(index + 1)
            else:
                break
        parser.declarations.add("::".join((*self.namespaces, *self.classes, name)))
        return parser.skip_until(index, self.end, (";",)) + 1

    def after_body(self, index):
        """The index after a function's body, which its initializers, `try` and handlers may surround."""
        parser = self.parser
        has_handlers = parser.text(index) == "try"
        index += has_handlers
        if parser.text(index) == ":":
            index = self.after_initializers(index + 1)
        index = parser.after_group(index)
        while has_handlers and parser.text(index) == "catch":
            index = parser.after_group(parser.after_group(index + 1))
        return index

    def after_initializers(self, index):
        """The index of the body after a constructor's initializers, whose values are in parentheses or braces."""
        parser = self.parser
        while True:
            index = parser.skip_until(index, self.end, ("(", "{"))
            index = parser.after_group(index)
            while parser.text(index) == "...":
                index += 1
            if parser.text(index) != ",":
                return index
            index += 1

    HANDLERS = {"class": class_key, "struct": class_key, "union": class_key, "enum": enum, ",": comma, "<": angles,
                "[": bracket, ":": colon, "{": brace, "=": equals, "operator": operator, "(": parenthesis}


class Source:
    """Classes, functions, includes and strings of a file. Throws ParseError."""

    def __init__(self, text):
        self.tokens, self.includes = tokens_of(text)
        parser = Parser(self.tokens)
        self.classes, self.functions, self.declarations = parser.classes, parser.functions, parser.declarations
