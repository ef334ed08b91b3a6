"""The library builds with Clang and libc++, and works in a process beside libstdc++.

It builds the library without OpenVDB and Draco. Debian builds OpenEXR with libstdc++, so its functions with standard
types cannot be linked. A library of functions that end the process replaces them. Everything else must link. The Python
package of the build then reads files and renders with this library as with the build's own.

Usage: libcxx_test.py SOURCE_DIR PYTHON_FOLDER
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

FLAGS = "-stdlib=libc++"
# Debian's OpenVDB and Draco have types of libstdc++ in their interfaces.
OFF = ("OPENVDB", "DRACO", "BUILD_APPS", "BUILD_HOSTS", "BUILD_TESTS", "BUILD_BENCH", "INSTALL")
PROBE = """
#include <algorithm>
#include <stdexcept>
#include <vector>
int main() {
  const std::vector<int> values{1, 2};
  try {
    throw std::runtime_error("caught");
  } catch (const std::exception&) {
    return std::ranges::find(values, 2) == values.end();
  }
}
"""
# Prints a line per file, then the picture. The last line is the library that did it.
USE = """
import array, pathlib, sys
import cumulet
for path in sorted(pathlib.Path(sys.argv[1]).rglob("*")):
    if not path.is_file():
        continue
    data = path.read_bytes()
    for kind, arguments in ((cumulet.Volume, {"path": "it"}), (cumulet.Surfaces, {"name": "it"}),
                            (cumulet.Environment, {"name": "it"})):
        try:
            if kind is cumulet.Environment and data[:4] == bytes((0x76, 0x2f, 0x31, 0x01)):
                continue  # OpenEXR
            print(path.name, kind.__name__, kind.from_bytes(data, **arguments).get_info())
        except cumulet.Error as error:
            print(path.name, kind.__name__, error)
side = 16
values = array.array("f", (((x - 8) ** 2 + (y - 8) ** 2 + (z - 8) ** 2 < 40) * 1.0
                           for x in range(side) for y in range(side) for z in range(side)))
picture = cumulet.render(memoryview(values).cast("B").cast("f", (side,) * 3), size=(32, 24), samples=4, progress=False)
print("picture", *(f"{value:.3g}" for value in list(picture.linear.cast("B").cast("f"))[::97]))
print(next(line.split()[-1] for line in open("/proc/self/maps") if "libcumulet.so" in line))
"""


def fail(cause):
    sys.exit(f"libcxx_test: {cause}")


def skip(cause):
    print(f"libcxx_test: skipped: {cause}")
    sys.exit(77)


def output(*command, **options):
    return subprocess.run(list(map(str, command)), check=True, text=True, stdout=subprocess.PIPE, **options).stdout


def symbols(file, *flags):
    lines = output("nm", "-D", "-P", *flags, file).splitlines()
    return {line.split()[0].split("@")[0] for line in lines}


def compiler_with_libcxx(folder):
    """The path of a Clang that compiles with a libc++ that has the algorithms of C++20, or None."""
    (folder / "probe.cpp").write_text(PROBE)
    clang = shutil.which("clang++")
    command = [clang, "-std=c++20", FLAGS, folder / "probe.cpp", "-o", folder / "probe"]
    works = clang is not None and subprocess.run(list(map(str, command)), stderr=subprocess.DEVNULL).returncode == 0
    return clang if works and subprocess.run([folder / "probe"]).returncode == 0 else None


def build(source, folder, clang):
    off = [f"-DCUMULET_{feature}=OFF" for feature in OFF]
    # TinyGLTF is compiled from its header, for the same reason.
    output("cmake", "-S", source, "-B", folder, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={clang}",
           f"-DCMAKE_C_COMPILER={clang[:-2]}", f"-DCMAKE_CXX_FLAGS={FLAGS}", "-DCMAKE_CXX_FLAGS_RELEASE=-O1",
           "-DCMAKE_DISABLE_FIND_PACKAGE_TinyGLTF=ON", *off)
    output("cmake", "--build", folder, "--target", "cumulet")
    return folder / "lib"


def replace_openexr(library, folder):
    """Makes the symbols that no library defines available, and returns their library. They must all be of OpenEXR."""
    dependencies = re.findall(r"(/\S+) \(0x", output("ldd", library))
    defined = set().union(*(symbols(path, "--defined-only") for path in dependencies))
    lines = output("nm", "-D", "-P", "--undefined-only", library).splitlines()
    weak = {line.split()[0].split("@")[0] for line in lines if line.split()[1] in "wv"}
    missing = symbols(library, "--undefined-only") - defined - weak
    foreign = sorted(name for name in missing if not re.search(r"\d(Imf|Iex|Imath)_\d", name))
    if foreign:
        fail(f"libcumulet with libc++ lacks {foreign[:5]}")
    print(f"{len(missing)} functions of OpenEXR are replaced")
    code = folder / "missing.s"
    code.write_text("\n".join([".text", *(f'.globl "{name}"\n"{name}":' for name in sorted(missing)), "ud2",
                               '.section .note.GNU-stack,"",@progbits', ""]))
    output("cc", "-shared", "-o", folder / "libmissing.so", code)
    return folder / "libmissing.so"


def lines_of(use, python, libraries, **environment):
    """The lines of USE with the libraries of a folder."""
    changes = {"PYTHONPATH": str(python), "CUMULET_LIBRARY_DIR": str(libraries), **environment}
    result = subprocess.run(list(map(str, use)), env={**os.environ, **changes}, text=True, capture_output=True)
    if result.returncode != 0:
        fail(f"Python ended with {result.returncode}: {result.stderr.strip()}")
    *lines, used = result.stdout.splitlines()
    if pathlib.Path(used).resolve().parent != pathlib.Path(libraries).resolve():
        fail(f"Python used {used}, not that of {libraries}")
    # The library of the test does not read these.
    return [line for line in lines if "OpenVDB" not in line and "CUMULET_" not in line]


def main():
    source, python = map(pathlib.Path, sys.argv[1:])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        clang = compiler_with_libcxx(folder)
        if clang is None:
            skip("it needs Clang, libc++ 16 or later and libc++abi (Debian: libc++-16-dev, libc++abi-16-dev)")
        libraries = build(source, folder / "build", clang)
        missing = replace_openexr(libraries / "libcumulet.so", folder)

        (folder / "use.py").write_text(USE)
        use = [sys.executable, "-B", folder / "use.py", source / "tests/fuzz/corpus"]
        wanted = lines_of(use, python, python / "cumulet/lib")
        found = lines_of(use, python, libraries, LD_PRELOAD=str(missing))
        if len(wanted) < 20 or not wanted[-1].startswith("picture"):
            fail(f"the build's own library printed {wanted}")
        # Files that only one of the two reads are left out of both.
        keys = [{tuple(line.split()[:2]) for line in lines} for lines in (wanted, found)]
        both = keys[0] & keys[1]
        different = [pair for pair in zip(*([line for line in lines if tuple(line.split()[:2]) in both]
                                            for lines in (wanted, found))) if pair[0] != pair[1]]
        if different:
            fail(f"with libc++ it says '{different[0][1]}', not '{different[0][0]}'")
        print(f"{len(both)} equal lines by libstdc++ and libc++")


if __name__ == "__main__":
    main()
