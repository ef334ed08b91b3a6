"""A libcumulet with CUMULET_PRIVATE_DEPENDENCIES works in a process with other versions of its dependencies.

It builds the library, and a library of decoys: for each function of a dependency that is inside libcumulet, a function
of the same name that ends the process. The decoys are loaded before libcumulet, and in another process after it. Files
that need the dependencies are then read as without them, and the process still finds its own version.

Usage: private_test.py SOURCE_DIR
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

HOST_VERSION = 4711  # what the host's own WebP returns
READ = """
import base64, ctypes, json, sys
library = ctypes.CDLL(sys.argv[1])
later = [ctypes.CDLL(path, ctypes.RTLD_GLOBAL) for path in sys.argv[2:]]
def read(file):
    data, handle, line = json.dumps(file).encode(), ctypes.c_void_p(), ctypes.create_string_buffer(512)
    status = library.cumulet_surfaces_from_memory(data, ctypes.c_size_t(len(data)), None, b"it", ctypes.byref(handle),
                                                  line, ctypes.c_size_t(512))
    library.cumulet_surfaces_release(handle)
    print(status, line.value.decode())
    sys.stdout.flush()
points = base64.b64encode(bytes(12) + bytes([0, 0, 128, 63]) + bytes(16) + bytes([0, 0, 128, 63])).decode()
head = {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + points}],
        "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0}]}
primitive = {"attributes": {"POSITION": 0}}
packed = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
read({**head, "extensionsUsed": list(packed), "meshes": [{"primitives": [{**primitive, "extensions": packed}]}]})
webp = base64.b64decode("UklGRhoAAABXRUJQVlA4TA0AAAAvAAAAEAcQERGIiP4HAA==")
uri = "data:image/webp;base64," + base64.b64encode(webp).decode()
read({**head, "extensionsUsed": ["EXT_texture_webp"], "images": [{"uri": uri, "mimeType": "image/webp"}],
      "textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}],
      "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
      "meshes": [{"primitives": [{**primitive, "material": 0}]}]})
own = getattr(ctypes.CDLL(None), "WebPGetDecoderVersion", None)
print(own() if own else "none")
"""


def fail(cause):
    sys.exit(f"private_test: {cause}")


def output(*command, **options):
    return subprocess.run(list(map(str, command)), check=True, text=True, stdout=subprocess.PIPE, **options).stdout


def symbols(file, *flags):
    """Names of symbols, without their versions."""
    lines = output("nm", "-P", *flags, file, stderr=subprocess.DEVNULL).splitlines()
    return {line.split()[0].split("@")[0] for line in lines if len(line.split()) > 1}


def functions_of(archive):
    """Functions that an archive defines, without inline ones of the C++ runtime, which is shared."""
    lines = output("nm", "-P", "--defined-only", "--extern-only", archive, stderr=subprocess.DEVNULL).splitlines()
    names = {line.split()[0] for line in lines if re.match(r"\S+ [TW] ", line)}
    # Debian's libdraco.a also has a tinygltf and stb, which libcumulet takes from elsewhere.
    return {name for name in names if not re.match(r"_ZN?K?S[a-z]|_ZNK?9__gnu_cxx|_ZNK?8tinygltf|stbi_", name)}


def needed_by_others(library):
    """Symbols that other libraries of the process import. They must not get decoys."""
    found = set()
    for path in re.findall(r"=> (/\S+)", output("ldd", library)):
        found |= symbols(path, "-D", "--undefined-only")
    return found


def write_decoys(names, folder):
    code = folder / "decoys.s"
    lines = [".text", ".globl WebPGetDecoderVersion", "WebPGetDecoderVersion:", f"mov ${HOST_VERSION}, %eax", "ret"]
    for name in sorted(names - {"WebPGetDecoderVersion"}):
        lines += [f'.globl "{name}"', f'"{name}":']
    code.write_text("\n".join([*lines, "ud2", '.section .note.GNU-stack,"",@progbits', ""]))
    library = folder / "libdecoys.so"
    output("cc", "-shared", "-o", library, code)
    return library


def main():
    source = pathlib.Path(sys.argv[1])
    if not sys.platform.startswith("linux") or os.uname().machine != "x86_64":
        print("private_test: skipped: it needs Linux on x86_64")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        off = [f"-DCUMULET_{what}=OFF" for what in ("BUILD_APPS", "BUILD_HOSTS", "BUILD_TESTS", "BUILD_BENCH", "INSTALL")]
        said = output("cmake", "-S", source, "-B", folder, "-G", "Ninja", "-DCUMULET_PRIVATE_DEPENDENCIES=ON", *off,
                      stderr=subprocess.STDOUT)
        lines = [line for line in said.splitlines() if "CUMULET_PRIVATE_DEPENDENCIES" in line]
        if len(lines) > 1:
            fail(f"CMake says more than one line: {lines}")
        print(*lines, sep="\n")
        archives = [path for path in (folder / "private_libraries.txt").read_text().split(";") if path.endswith(".a")]
        if not archives:
            print("private_test: skipped: there are no static libraries")
            sys.exit(77)
        output("cmake", "--build", folder, "--target", "cumulet")
        library = folder / "lib/libcumulet.so"

        inside = set().union(*map(functions_of, archives))
        exported = {one for one in symbols(library, "-D", "--defined-only") if not one.startswith("cumulet_")}
        if exported:
            fail(f"libcumulet exports {sorted(exported)[:3]}")
        imported = symbols(library, "-D", "--undefined-only") & inside
        if imported:
            fail(f"libcumulet imports {sorted(imported)[:3]}, which are inside")

        # libdraco.a contains an older tinygltf than that of the headers.
        if not any("tinygltf" in path for path in archives):
            older = {one for one in symbols(library, "--defined-only") if one.startswith("_ZN8tinygltf8TinyGLTF")}
            if older:
                fail(f"libcumulet contains {sorted(older)[:3]} of another library")

        decoys = write_decoys(inside - needed_by_others(library), folder)
        read = [sys.executable, "-c", READ, library]
        alone = output(*read).splitlines()
        before = output(*read, env={**os.environ, "LD_PRELOAD": str(decoys)}).splitlines()
        after = output(*read, decoys).splitlines()
        for beside in (before, after):
            if not alone or alone[:-1] != beside[:-1]:
                fail(f"files are read otherwise beside other versions: {alone}, {beside}")
            if beside[-1] != str(HOST_VERSION):
                fail(f"the process finds another WebP than its own: {beside[-1]}")
        print(*before, sep="\n")


if __name__ == "__main__":
    main()
