"""cpp.py finds classes and functions in all forms of declarations. house.py reports each offender, and holds bounds."""

import pathlib
import subprocess
import sys
import textwrap
import unittest

HOUSE = pathlib.Path(__file__).resolve().with_name("house.py")
sys.path[:0] = [str(HOUSE.parent), str(HOUSE.parent.parent / "support")]
import checkout  # noqa: E402
import cpp  # noqa: E402

TABLE = """# Architecture

## Source layout

| Folder | Purpose | GL | May include |
|---|---|---|---|
| `src/base` | errors and log | no | nothing |
| `src/volume` | import | no | `base` |
| `src/gl` | function table | yes | `base` |
| `src/viewer` | the viewer | yes | all above |
| `demo/` | programs | yes | `base` |
| `tests/` | tests | yes | all above |

## Threads

| Folder | Purpose |
|---|---|
| `src/other` | not a row of the table |
"""
GOOD = {
    "docs/architecture.md": TABLE,
    "src/base/a.hpp": "#pragma once\nstruct A { int x = 0; };\n",
    "src/volume/v.hpp": '#include "base/a.hpp"\nA make();\n',
    "src/volume/v.cpp": '#include "volume/v.hpp"\nA make() { return {}; }\n',
    "src/gl/g.hpp": "#include <glad/gl.h>\nnamespace gl { struct Functions {}; }\n",
    "src/viewer/w.hpp": '#include "gl/g.hpp"\n#include "volume/v.hpp"\n',
    "demo/app/main.cpp": '#include "base/a.hpp"\nint main() { return 0; }\n',
    "tests/unit/a_test.cpp": '#include "base/a.hpp"\n',
}


def classes(text):
    """{name: names of members}"""
    return {one.name: one.members for one in cpp.Source(textwrap.dedent(text)).classes}


def functions(text):
    """{name: (lines, complexity)}"""
    return {one.name: (one.lines, one.complexity) for one in cpp.Source(textwrap.dedent(text)).functions}


def members(text):
    """The members of class A, whose body is given."""
    return classes("struct A {\n" + text + "\n};")["A"]


def complexity(body):
    return functions("void f() {\n" + body + "\n}")["f"][1]


def fields(count):
    return "".join(f"  int m{i};\n" for i in range(count))


class Members(unittest.TestCase):
    def test_initializers(self):
        self.assertEqual(members("int a; int b = 1; int c{2}; std::vector<int> d{1, 2}; P e = {.x = 1, .y = {2, 3}};\n"
                                 "std::array<int, 2> f{{1, 2}}; bool g = x < y; int h = f<1, 2>(3);"), list("abcdefgh"))

    def test_several_declarators(self):
        self.assertEqual(members("int a, *b, c[2], d = f(1, 2), e{1}; const char *const g;"), list("abcdeg"))

    def test_types(self):
        self.assertEqual(members("unsigned long long a; const std::uint64_t b; mutable std::mutex c; struct T d;\n"
                                 "class T e; enum T f; typename T::type g; decltype(x) h; volatile bool i; T& j; T&& k;\n"
                                 "std::map<int, std::vector<A<(1 > 2)>>> l;"), list("abcdefghijkl"))

    def test_functions_in_members(self):
        self.assertEqual(members("std::function<void(int, int)> a; std::function<void()> b = [](int x) { return x; };\n"
                                 "void (*c)(int, int) = nullptr; int (A::*d)(int); void* (*e)(void*, const char*);\n"
                                 "int (*f)[3]; void (CALL *g)(int); void (*h[2])(int x);"), list("abcdefgh"))

    def test_bit_fields(self):
        self.assertEqual(members("unsigned a : 3, b : width(5); int : 0; std::uint8_t : width; const T : 1;\n"
                                 "typename T::type : 1; T c : 1 = 1; bool d : 1 {true};"), list("abcd"))

    def test_static_members(self):
        self.assertEqual(members("static int a; static constexpr int b = 1; inline static T c{}; int d;"), ["d"])

    def test_declarations_without_members(self):
        self.assertEqual(members("using X = std::vector<int>; typedef int Y; friend class Z; struct F; enum E : int;\n"
                                 "static_assert(sizeof(int) == 4); template <class T> struct G; enum H { h1, h2 };\n"
                                 "enum class I : int { i1 = 1, i2 }; using std::f; extern int y; int z;"), ["z"])

    def test_functions_are_no_members(self):
        self.assertEqual(members("""
            A(); explicit A(int x) : x_(x), y_{1, 2} {}  A(const A&) = delete; virtual ~A() = default;
            A& operator=(const A&) = default; bool operator==(const A&) const = default; int operator()(int x) const;
            explicit operator bool() const { return true; } auto operator<=>(const A&) const = default;
            int operator[](int i) { return i; } bool operator<(A b) const; void* operator new[](std::size_t);
            [[nodiscard]] int f(int x = g(1)) const noexcept; virtual void h() = 0; auto i() -> std::vector<int>;
            template <class T> requires Number<T> T j(T x) { return x; } friend A operator+(A, A) { return {}; }
            std::vector<int> k() &&; void l() const& noexcept(true); static A m(); constexpr A(int a, int b);
            int x_;"""), ["x_"])

    def test_access_and_attributes(self):
        self.assertEqual(members("public: int a; private: alignas(16) float b; [[maybe_unused]] int c; int d [[x]];\n"
                                 "protected:\n  __attribute__((packed)) int e;"), list("abcde"))

    def test_macros(self):
        self.assertEqual(members("Q_OBJECT\npublic: int a; signals: void f(); public slots: int b; ALIGN(16) float c;\n"
                                 "EQUALITY(A)\nint d;"), list("abcd"))

    def test_types_defined_with_a_member(self):
        found = classes("struct A { enum class E { x, y } e; struct { int i, j; } s; struct N { int k; } n[2]; };")
        self.assertEqual(found, {"A": ["e", "s", "n"], "A::s": ["i", "j"], "A::N": ["k"]})

    def test_anonymous_structs_and_unions(self):
        self.assertEqual(classes("struct A { int a; union { int b; struct { int c, d; }; }; int e; };"),
                         {"A": list("abcde")})

    def test_nested_classes_are_classes_of_their_own(self):
        self.assertEqual(classes("namespace n::o { class A { struct B { int x; }; B b; int c; }; }"),
                         {"n::o::A": ["b", "c"], "n::o::A::B": ["x"]})

    def test_heads(self):
        found = classes("""
            template <class T, int n = (1 > 0)> requires C<T> class A final : public B<T, D>, private E { int a; };
            template <> struct std::hash<A<int>> { int b; };
            class EXPORT F { int c; };
            struct alignas(16) [[deprecated]] G { int d; };
            struct A::Impl { int e; };
            union H { int f; float g; };
            enum class NoClass { x };
            typedef struct { int h; } I;
            struct tm when{};
            """)
        self.assertEqual(found, {"A": ["a"], "std::hash<A<int>>": ["b"], "F": ["c"], "G": ["d"], "A::Impl": ["e"],
                                 "H": ["f", "g"], "I": ["h"]})

    def test_classes_in_functions(self):
        self.assertEqual(classes("int f() { struct A { int a; void g() { } }; auto h = []<class T>(T x) { return x; }; }"),
                         {"f::A": ["a"]})

    def test_extern_c_and_other_scopes(self):
        self.assertEqual(classes('extern "C" { struct A { int a; }; }\nnamespace { struct B { int b; }; }\n'
                                 "inline namespace v1 { struct C { int c; }; }\nnamespace x = y;\nstruct D { int d; };"),
                         {"A": ["a"], "B": ["b"], "v1::C": ["c"], "D": ["d"]})

    def test_classes_that_a_macro_begins(self):
        self.assertEqual(classes("BLOCK(A) { int a; };\nTEST(Suite, Name) { int x; }\n"), {"A": ["a"]})

    def test_text_that_is_no_code(self):
        self.assertEqual(members(r'''
            int a;  // int n; }
            /* int n; } */ const char* b = "int n; } \" // "; char c = '}'; char d = '\'';
            const char* e = R"x(int n; } )" )x"; int f = 1'000; float g = 1'0e+3F;
            #define M int n; } \
                      int o;
            int h;'''), list("abcdefgh"))

    def test_conditions(self):
        self.assertEqual(members("#if X\nint a;\n#else\nint b;\n#endif\n#if 0\nint n;\n#endif\nint c;"), ["a", "b", "c"])
        self.assertEqual(classes("#ifdef X\nstruct A {\n#else\nblock A {\n#endif\nint a;\n};"), {"A": ["a"]})

    def test_brackets_that_do_not_match(self):
        for text in ("struct A { int a;", "int f() { return (1; }", "}", "A::A() : a"):
            with self.assertRaises(cpp.ParseError):
                cpp.Source(text)


class Functions(unittest.TestCase):
    def test_names(self):
        found = functions("""
            int f() { return 1; }
            A::A(int x) : a_(x), b_{x, 1}, B<int>(f(x)), c_(xs)... { }
            A::~A() { }
            template <class T> void A<T>::g() const noexcept { }
            bool operator==(const A& a, const A& b) { return true; }
            A::operator bool() const { return true; }
            int A::operator()(int x) { return x; }
            auto h() -> std::vector<int> { return {}; }
            template <class T> requires (A<T> && B<T>) || requires(T t) { t.x(); } T i(T t) requires C<T> { return t; }
            void j() try { } catch (const E& e) { } catch (...) { }
            TEST_F(Suite, Name) { }
            constexpr auto k = [](int x) { return x; };
            void* (*l(int x))(int) { return nullptr; }
            const std::map<int, A>& m() { return x; }
            extern "C" void n() { }
            struct S { S() : x(1) {} void o() & { } friend bool operator<(S, S) { return true; } int x; };
            int p();
            int q = f();
            [[gnu::const]] static inline unsigned long r(void (*callback)(int)) { return 1; }
            """)
        self.assertEqual(list(found), ["f", "A::A", "A::~A", "A<T>::g", "operator==", "A::operator bool", "A::operator()",
                                       "h", "i", "j", "TEST_F(Suite,Name)", "k", "l", "m", "n", "S::S", "S::o",
                                       "S::operator<", "r"])

    def test_lines(self):
        found = functions("""
            // no line of it

            template <class T>
            int f(int a,
                  int b) {
              // a line of it

              return a;
            }  int g() { return 1; }
            struct A {
              int h() {
                return 1;
              }
            };
            """)
        self.assertEqual({name: lines for name, (lines, _) in found.items()}, {"f": 7, "g": 1, "A::h": 3})

    def test_lines_around_directives_comments_and_strings(self):
        self.assertEqual(functions('/* a\n*/ int f() {\n#if X\n  x(R"(a\nb)");\n#endif\n  /*\n  */ return 1;\n}')["f"][0], 8)

    def test_complexity(self):
        for body, count in (("a();", 1), ("if (a) b();", 2), ("if (a) b(); else if (c) d(); else e();", 3),
                            ("for (;;) while (a) b();", 3), ("do a(); while (b);", 2),
                            ("switch (a) { case 1: case 2: b(); default: c(); }", 3),
                            ("try { a(); } catch (const B&) { } catch (...) { }", 3),
                            ("return a && b || c;", 3), ("return a&&b;", 2), ("return a and b or c;", 3),
                            ("return a ? b : c ? d : e;", 3), ("if constexpr (A<T> && B<T>) c();", 3),
                            ("auto f = [](int x) { return x ? 1 : 2; };", 2)):
            self.assertEqual(complexity(body), count, body)

    def test_complexity_of_other_tokens(self):
        self.assertEqual(complexity('auto&& a = b; for_each<A&&>(x); [](Body&& body, auto&&... c) {}; s = "if (a && b)";\n'
                                    "// if (a)\n/* while */ iffy(whiles); c = '?';\n#if A && B\n#endif\nx = 1'000;"), 1)

    def test_complexity_of_initializers_but_not_of_parameters(self):
        found = functions("A::A(int x, bool y = a && b) : a_(x ? 1 : 2) { }\ntemplate <class T> requires (A<T> && B<T>)\n"
                          "void f(T&& t) { }")
        self.assertEqual([found["A::A"][1], found["f"][1]], [2, 1])

    def test_complexity_after_a_requires_expression(self):
        text = "template <class T>\nvoid f(T t) requires requires(T u) { u.x(); } && A<T> {\nif (t) g();\n}"
        self.assertEqual(functions(text)["f"], (4, 2))

    def test_declarations_have_full_names(self):
        source = cpp.Source("namespace a::b { void f(int); struct S { void g(); }; void h() {} }\nvoid a::b::S::g() {}")
        self.assertEqual(source.declarations, {"a::b::f", "a::b::S::g"})
        self.assertEqual([one.full_name for one in source.functions], ["a::b::h", "a::b::S::g"])


class Checkout(checkout.Checkout):
    def setUp(self):
        super().setUp()
        self.bounds = self.folder / "bounds.txt"
        self.bounds.write_text("# exceptions\n")
        self.write(GOOD)

    def bound(self, *lines):
        self.bounds.write_text("\n".join(("# exceptions", *lines)) + "\n")

    def house(self, *arguments):
        """Exit status and output of house.py."""
        done = subprocess.run([sys.executable, "-B", HOUSE, self.root, "--bounds", self.bounds, *arguments],
                              capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    def passes(self):
        status, output = self.house()
        self.assertEqual(status, 0, output)

    def reported(self, *expected):
        """Exactly these messages are printed, of which beginnings are given."""
        status, output = self.house()
        self.assertEqual(status, 1, output)
        self.assertEqual(len(output.splitlines()), len(expected), output)
        for line, beginning in zip(output.splitlines(), expected):
            self.assertEqual(line[:len(beginning)], beginning, output)

    def updated(self, *expected):
        """--update leaves these lines."""
        self.assertEqual(self.house("--update"), (0, ""))
        self.assertEqual(self.bounds.read_text().splitlines(), ["# exceptions", *expected])


class Rules(Checkout):
    def test_a_good_tree(self):
        self.passes()

    def test_an_include_of_a_higher_folder(self):
        self.write({"src/base/b.cpp": '#include "base/a.hpp"\n#include "volume/v.hpp"\n'})
        self.reported("src/base/b.cpp:2: include src/base/b.cpp -> src/volume/v.hpp; the table")

    def test_an_include_that_the_table_does_not_list(self):
        self.write({"src/gl/h.cpp": '#include "../volume/v.hpp"\n', "demo/app/b.cpp": '#include <volume/v.hpp>\n'})
        self.reported("demo/app/b.cpp:1: include demo/app/b.cpp -> src/volume/v.hpp",
                      "src/gl/h.cpp:1: include src/gl/h.cpp -> src/volume/v.hpp")

    def test_gl_in_a_folder_without_gl(self):
        self.write({"src/volume/b.cpp": '#include <glad/gl.h>\n// GL_RGBA, gl::Functions\nvoid f() { log("GL_RGBA"); }\n'
                                        "gl::FunctionsPtr gl_;\nGLuint a;\nint b = GL_RGBA;\nint gl = 1;\n"
                                        "namespace gl { class Functions; }\n",
                    "src/gl/b.cpp": "GLuint a;\n"})
        start = "src/volume/b.cpp:{}: 'src/volume' is free of GL, but uses '{}'"
        uses = ((1, "glad/gl.h"), (4, "gl"), (5, "GLuint"), (6, "GL_RGBA"), (8, "gl"))
        self.reported(*(start.format(*use) for use in uses))

    def test_gl_headers_of_the_tree(self):
        self.write({"src/volume/b.cpp": '#include "gl/g.hpp"\n'})
        self.reported("src/volume/b.cpp:1: 'src/volume' is free of GL, but uses 'gl/g.hpp'",
                      "src/volume/b.cpp:1: include src/volume/b.cpp -> src/gl/g.hpp")

    def test_tables(self):
        for old, new, message in (
                ("| errors and log |", "|  |", "docs/architecture.md:7: 'src/base' has no purpose"),
                ("| import | no |", "| import | perhaps |", "docs/architecture.md:8: the column GL of 'src/volume' must"),
                ("import | no | `base`", "import | no | base", "docs/architecture.md:8: May include of 'src/volume' must"),
                ("log | no | nothing", "log | no | `gl`", "docs/architecture.md:7: 'src/base' may not include 'gl'"),
                ("## Threads", "| `src/none` | none | no | `base` |\n\n## Threads", None),
                ("`demo/`", "`demos/`", "docs/architecture.md:11: there is no folder 'demos'"),
                ("## Source layout", "## Layout", "docs/architecture.md: the section 'Source layout' has no table")):
            with self.subTest(new):
                self.write({"docs/architecture.md": TABLE.replace(old, new, 1)})
                status, output = self.house()
                self.assertEqual(status, 0 if message is None else 1)
                self.assertIn(message or "", output)

    def test_a_folder_that_the_table_lacks(self):
        self.write({"src/other/b.cpp": "int a;\n"})
        self.reported("src/other/b.cpp: its folder is not in the table")

    def test_a_circle_of_includes(self):
        self.write({"src/base/a.cpp": '#include "base/b.hpp"\n', "src/base/b.hpp": '#include "c.hpp"\n',
                    "src/base/c.cpp": '#include "base/a.hpp"\n', "src/base/c.hpp": "int c();\n",
                    "src/base/d.hpp": '#include "base/a.hpp"\n#include "base/d.hpp"\n'})
        self.reported("these files include each other: src/base/a src/base/b src/base/c (src/base/a.cpp -> src/base/b.hpp, ")

    def test_a_circle_through_a_header_without_a_source_of_its_name(self):
        self.write({"src/base/face.hpp": "namespace n { void f(); }\n", "src/base/part.hpp": '#include "base/face.hpp"\n',
                    "src/base/whole.cpp": '#include "base/face.hpp"\n#include "base/part.hpp"\nvoid n::f() {}\n'})
        self.reported("these files include each other: src/base/part src/base/whole (")
        self.write({"src/base/more.cpp": '#include "base/face.hpp"\nvoid n::f() {}\n'})  # then it is an interface
        self.passes()

    def test_a_class_with_too_many_members(self):
        self.write({"src/base/b.hpp": f"namespace cumulet::base {{\nclass B {{\n{fields(30)}}};\n}}\n"})
        self.passes()
        self.write({"src/base/b.hpp": f"namespace cumulet::base {{\nclass B {{\n{fields(31)}}};\n}}\n"})
        self.reported("src/base/b.hpp:2: class base::B: data members 31; limit: data members 30")

    def test_a_function_with_too_many_lines(self):
        self.write({"src/base/b.cpp": "void f() {\n" + "g();\n" * 78 + "}\n"})
        self.passes()
        self.write({"src/base/b.cpp": "void f() {\n" + "g();\n" * 79 + "}\n"})
        self.reported("src/base/b.cpp:1: function src/base/b.cpp:f: lines 81, complexity 1; limit: lines 80, complexity 40")

    def test_a_function_with_too_many_decisions(self):
        self.write({"demo/app/b.cpp": "void f() {\n" + "if (a) g(); " * 39 + "\n}\n"})
        self.passes()
        self.write({"demo/app/b.cpp": "void f() {\n" + "if (a) g(); " * 40 + "\n}\n"})
        self.reported("demo/app/b.cpp:1: function demo/app/b.cpp:f: lines 3, complexity 41; limit: lines 80, complexity 40")

    def test_a_file_with_too_many_lines(self):
        self.write({"src/base/b.hpp": "\n" * 800, "demo/b.py": "\n" * 800, "docs/long.md": "\n" * 900})
        self.passes()
        self.write({"src/base/b.hpp": "\n" * 801, "demo/b.py": "\n" * 801})
        self.reported("demo/b.py: file demo/b.py: lines 801; limit: lines 800",
                      "src/base/b.hpp: file src/base/b.hpp: lines 801; limit: lines 800")

    def test_a_file_of_tests_with_too_many_lines(self):
        self.write({"tests/unit/b.cpp": "\n" * 600, "tests/farm/b.py": "\n" * 600})
        self.passes()
        self.write({"tests/unit/b.cpp": "\n" * 601, "tests/farm/b.py": "\n" * 601})
        self.reported("tests/farm/b.py: file tests/farm/b.py: lines 601; limit: lines 600",
                      "tests/unit/b.cpp: file tests/unit/b.cpp: lines 601; limit: lines 600")
        self.bound("file tests/farm/b.py 601", "file tests/unit/b.cpp 700")
        self.reported("bounds.txt: file tests/unit/b.cpp has become smaller")
        self.updated("file tests/farm/b.py 601", "file tests/unit/b.cpp 601")

    def test_a_file_that_is_not_understood(self):
        self.write({"src/base/b.cpp": "int f() {\n"})
        self.reported("src/base/b.cpp: line 1: '{' is not closed")

    def test_report(self):
        self.write({"src/gl/b.cpp": 'auto a = {"CM_A 1", R"(CM_B)"};  // "CM_C"\n#define D "CM_D"\nint CM_E;\n'})
        status, output = self.house("--report")
        self.assertEqual(status, 0, output)
        self.assertRegex(output, r"(?m)^src/volume +2 +4 +0 +1$")
        self.assertRegex(output, r"Largest classes, data members:\n +1  A\n")
        self.assertIn('"CM_" string literals of src: 2 in 1 files\n', output)
        self.assertIn("exceptions: 0 (class 0, ", output)


class Exceptions(Checkout):
    def test_listed_values_pass_and_larger_ones_do_not(self):
        self.write({"src/base/b.hpp": f"class B {{\n{fields(32)}}};\n", "src/base/c.hpp": "\n" * 801,
                    "src/base/d.cpp": "void f() {\n" + "if (a) g();\n" * 80 + "}\n"})
        self.bound("class B 32", "file src/base/c.hpp 801", "function src/base/d.cpp:f 82 81")
        self.passes()
        self.bound("class B 31", "file src/base/c.hpp 801", "function src/base/d.cpp:f 82 80")
        self.reported("src/base/b.hpp:1: class B: data members 32; bound: data members 31",
                      "src/base/d.cpp:1: function src/base/d.cpp:f: lines 82, complexity 81; bound: lines 82, complexity 80")
        self.updated("class B 31", "file src/base/c.hpp 801", "function src/base/d.cpp:f 82 80")

    def test_smaller_values_are_lowered(self):
        self.write({"src/base/b.hpp": f"class B {{\n{fields(32)}}};\n",
                    "src/base/d.cpp": "void f() {\n" + "g();\n" * 80 + "}\n"})
        self.bound("class B 33", "", "function src/base/d.cpp:f 83 1")
        self.reported("bounds.txt: class B has become smaller; run: ",
                      "bounds.txt: function src/base/d.cpp:f has become smaller")
        self.updated("class B 32", "", "function src/base/d.cpp:f 82 1")
        self.passes()

    def test_values_within_a_limit_may_change(self):
        self.write({"src/base/d.cpp": "void f() {\n" + "g();\n" * 80 + "if (a) g(); }\n"})
        for complexity_then in (1, 9):
            self.bound(f"function src/base/d.cpp:f 82 {complexity_then}")
            self.passes()

    def test_values_that_became_good_are_removed(self):
        self.write({"src/base/b.hpp": f"class B {{\n{fields(30)}}};\n"})
        self.bound("class B 31", "function src/base/none.cpp:f 90 1", "file src/base/none.hpp 900",
                   "include src/base/a.hpp -> src/gl/g.hpp", "circle src/base/a src/base/b 2")
        self.reported(*(f"bounds.txt: {name} no longer needs an exception; run: " for name in (
            "class B", "function src/base/none.cpp:f", "file src/base/none.hpp", "include src/base/a.hpp -> src/gl/g.hpp",
            "circle src/base/a src/base/b")))
        self.updated()
        self.passes()

    def test_records(self):
        self.write({"src/base/b.hpp": f"struct B {{\n{fields(31)}}};\n", "src/base/c.hpp": "\n" * 801})
        self.bound("record B options of the program", "record src/base/c.hpp a table")
        self.passes()
        self.write({"src/base/b.hpp": "struct B { int a; };\n"})
        self.reported("bounds.txt: record B no longer needs an exception")
        self.updated("record src/base/c.hpp a table")

    def test_listed_includes(self):
        self.write({"src/base/b.cpp": '#include "volume/v.hpp"\n#include "viewer/w.hpp"\n'})
        self.bound("include src/base/b.cpp -> src/volume/v.hpp")
        self.reported("src/base/b.cpp:2: include src/base/b.cpp -> src/viewer/w.hpp")

    def test_listed_circles_may_shrink_and_split(self):
        ring = {f"src/base/r{i}.hpp": f'#include "r{(i + 1) % 4}.hpp"\n' for i in range(4)}
        self.write(ring | {"src/base/r0.cpp": '#include "base/r0.hpp"\n'})
        self.bound("circle src/base/r0 src/base/r1 src/base/r2 src/base/r3 4")
        self.passes()
        self.write({"src/base/r0.hpp": '#include "r1.hpp"\n#include "r2.hpp"\n'})
        self.reported("these files include each other: src/base/r0 src/base/r1 src/base/r2 src/base/r3 (")
        self.write({"src/base/r0.hpp": '#include "r1.hpp"\n', "src/base/r1.hpp": '#include "r0.hpp"\n',
                    "src/base/r3.hpp": '#include "r2.hpp"\n'})
        self.reported("bounds.txt: circle src/base/r0 src/base/r1 src/base/r2 src/base/r3 has become smaller")
        self.updated("circle src/base/r0 src/base/r1 2", "circle src/base/r2 src/base/r3 2")
        self.passes()

    def test_a_part_of_a_listed_circle_has_no_more_includes(self):
        self.write({f"src/base/r{i}.hpp": f'#include "r{(i + 1) % 3}.hpp"\n#include "r{(i + 2) % 3}.hpp"\n'
                    for i in range(3)})
        self.bound("circle src/base/r0 src/base/r1 src/base/r2 src/base/r3 4")
        self.reported("these files include each other: src/base/r0 src/base/r1 src/base/r2 (",
                      "bounds.txt: circle src/base/r0 src/base/r1 src/base/r2 src/base/r3 no longer needs an exception")

    def test_a_larger_circle_is_another_one(self):
        self.write({f"src/base/r{i}.hpp": f'#include "r{(i + 1) % 3}.hpp"\n' for i in range(3)})
        self.bound("circle src/base/r0 src/base/r1 2")
        self.reported("these files include each other: src/base/r0 src/base/r1 src/base/r2 (",
                      "bounds.txt: circle src/base/r0")

    def test_functions_of_one_name(self):
        self.write({"src/base/d.cpp": "void f(int) {\n" + "g();\n" * 80 + "}\nvoid f() {\n" + "g();\n" * 90 + "}\n"})
        self.bound("function src/base/d.cpp:f 82 1")
        self.reported("src/base/d.cpp:83: function src/base/d.cpp:f#2: lines 92")
        self.bound("function src/base/d.cpp:f 82 1", "function src/base/d.cpp:f#2 92 1")
        self.passes()

    def test_update_adds_nothing(self):
        self.write({"src/base/b.hpp": f"class B {{\n{fields(31)}}};\n"})
        self.updated()

    def test_lines_that_are_not_understood(self):
        for line, message in (("struct B 31", "unknown kind 'struct'"), ("class B", "expected class NAME DATA MEMBERS"),
                              ("record B", "a record needs a reason"), ("function f 1", "expected function NAME LINES")):
            self.bound(line)
            status, output = self.house()
            self.assertEqual(status, 1)
            self.assertIn("bounds.txt:2: " + message, output)


if __name__ == "__main__":
    unittest.main()
