"""Every function of the public headers is callable from Python: by a method, or in the low-level module for a reason.

The environment has CUMULET_SOURCE, the root of the checkout.
"""

import ast
import ctypes
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import tokenize
import unittest

import cumulet
from cumulet import api, headless_api

SOURCE = pathlib.Path(os.environ["CUMULET_SOURCE"])
HEADERS = {"src/include/cumulet/cumulet.h": api, "demo/headless/cumulet_headless.h": headless_api}
# Functions that no method calls, because objects of Python count references themselves.
LOW_LEVEL = re.compile(r"cumulet_\w+_retain|cumulet_volume_open")
MOST_LINES_BY_HAND = 900
STATUSES_OF_NULL = {api.Status.ERROR_INVALID_ARGUMENT}


def functions_of(header):
    """Names and parameters, read without the generator's parser."""
    text = re.sub(r"/\*.*?\*/", " ", (SOURCE / header).read_text(encoding="utf-8"), flags=re.S)
    for name, parameters in re.findall(r"^CUMULET_API [^(;]*?\b(\w+)\(([^;]*)\);", text, flags=re.M | re.S):
        yield name, [] if parameters.strip() == "void" else parameters.split(",")


def code_lines(text):
    """The number of lines without blank ones, comments and docstrings."""
    ignored = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    lines = {line for token in tokenize.generate_tokens(io.StringIO(text).readline) if token.type not in ignored
             for line in range(token.start[0], token.end[0] + 1)}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
            lines -= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    return len(lines)


def zero(kind):
    if issubclass(kind, ctypes._CFuncPtr):
        return kind()
    return None if issubclass(kind, (ctypes._Pointer, ctypes.c_char_p, ctypes.c_void_p)) else 0


class Coverage(unittest.TestCase):
    def test_there_is_no_function_that_python_does_not_reach(self):
        folder = pathlib.Path(cumulet.__file__).parent
        code = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py")
                       if path.name not in ("api.py", "headless_api.py"))
        names = [name for header in HEADERS for name, _ in functions_of(header)]
        self.assertGreater(len(names), 150)
        missing = [name for name in names if f"api.{name}" not in code and not LOW_LEVEL.fullmatch(name)]
        self.assertEqual(missing, [], "add a rule to cmake/python_api.py or a method to python/cumulet")

    def test_low_level_functions_have_the_parameters_of_the_header(self):
        for header, module in HEADERS.items():
            for name, parameters in functions_of(header):
                function = getattr(module, name)
                self.assertEqual(len(function.argtypes), len(parameters), name)
                self.assertEqual(len(function.names), len(parameters), name)
                self.assertTrue(function.__doc__.strip(), name)

    def test_low_level_functions_can_be_called(self):
        for header, module in HEADERS.items():
            for name, _ in functions_of(header):
                function = getattr(module, name)
                if name in ("cumulet_region_pixels", "cumulet_camera_set_shutter"):
                    continue  # called by other tests, with arguments
                result = function(*map(zero, function.argtypes))
                if function.restype is ctypes.c_int:
                    self.assertIn(result, STATUSES_OF_NULL, name)

    def test_structs_have_the_layout_of_the_compiler(self):
        compiler = os.environ.get("CUMULET_CC", "cc")
        lines, wanted = [], []
        for module in HEADERS.values():
            for name, kind in sorted(vars(module).items()):
                if isinstance(kind, type) and issubclass(kind, api.Struct) and kind is not api.Struct:
                    lines.append(f'printf("{name} %zu\\n", sizeof({name}));')
                    wanted.append(f"{name} {ctypes.sizeof(kind)}")
                    for field, _ in kind._fields_:
                        lines.append(f'printf("{name}.{field} %zu\\n", offsetof({name}, {field}));')
                        wanted.append(f"{name}.{field} {getattr(kind, field).offset}")
        with tempfile.TemporaryDirectory() as folder:
            code = pathlib.Path(folder) / "layout.c"
            code.write_text("#include <cumulet_headless.h>\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {\n"
                            + "\n".join(lines) + "\nreturn 0;\n}\n")
            includes = [f"-I{SOURCE}/src/include", f"-I{SOURCE}/demo/headless"]
            subprocess.run([compiler, "-w", *includes, code, "-o", f"{folder}/layout"], check=True)
            found = subprocess.run([f"{folder}/layout"], check=True, capture_output=True, text=True).stdout.split("\n")
        self.assertEqual([line for line in found if line], wanted)

    def test_code_of_the_pages_has_existing_names(self):
        blocks = [block for page in ("docs/python.md", "README.md")
                  for block in re.findall(r"^```python\n(.*?)^```", (SOURCE / page).read_text(encoding="utf-8"), re.M | re.S)]
        self.assertGreater(len(blocks), 4)
        for block in blocks:
            compile(block, "page", "exec")
            for name, member in re.findall(r"\bcumulet\.(\w+)(?:\.(\w+))?", block.replace("libcumulet.", "")):
                self.assertTrue(hasattr(cumulet, name), name)
                self.assertTrue(not member or hasattr(getattr(cumulet, name), member), f"{name}.{member}")

    def test_day_is_that_of_the_programs(self):
        code = (SOURCE / "demo/scene_file/scene_file.cpp").read_text(encoding="utf-8")
        day = dict(re.findall(r"\blight\.(\w+) = ([\d.]+)f;", code))
        sun = re.search(r"\bsun = \{([^}]*)\};", code)[1].replace("f", "").split(",")
        for name, value in cumulet.DAY.items():
            if isinstance(value, float):
                self.assertEqual(value, float(day[name]), name)
        self.assertEqual(cumulet.DAY["sun_irradiance"], tuple(map(float, sun)))

    def test_version_is_that_of_the_library(self):
        self.assertEqual(cumulet.__version__, ".".join(map(str, api.VERSION)) + f".{api.cumulet_version() % 100}")

    def test_most_of_the_package_follows_from_the_headers(self):
        sources = sorted((SOURCE / "python/cumulet").glob("*.py"))
        self.assertLessEqual(sum(code_lines(path.read_text(encoding="utf-8")) for path in sources), MOST_LINES_BY_HAND)

    def test_old_pythons_can_read_the_package(self):
        for path in pathlib.Path(cumulet.__file__).parent.glob("*.py"):
            # __init__.py refuses older ones, and must be readable by them.
            version = (3, 7) if path.name == "__init__.py" else (3, 8)
            ast.parse(path.read_text(encoding="utf-8"), str(path), feature_version=version)

    def test_methods_have_signatures_and_documentation(self):
        import inspect
        names = inspect.signature(cumulet.Viewer.set_medium).parameters
        self.assertIn("density_scale", names)
        self.assertIn("1 / world unit", inspect.getdoc(cumulet.Viewer.set_medium))
        self.assertTrue((pathlib.Path(cumulet.__file__).parent / "api.pyi").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
