"""Writes a wheel of the Python package with the shared libraries that it needs.

The libraries are those of the portable tarball (bundle.cmake). Those that a GL driver also loads are in lib/fallback:
the package loads them only if the system has none.
"""
import argparse
import base64
import hashlib
import os
import pathlib
import platform
import re
import zipfile

TAG = f"py3-none-{platform.system().lower()}_{platform.machine()}"
METADATA = """Metadata-Version: 2.1
Name: cumulet
Version: {version}
Summary: Path-traced volumes: OpenVDB, NanoVDB, NumPy arrays and glTF, without a window or in an OpenGL context
License-File: LICENSE
Requires-Python: >=3.8
Provides-Extra: numpy
Requires-Dist: numpy; extra == 'numpy'
Description-Content-Type: text/markdown

# cumulet

    import cumulet
    cumulet.render("cloud.vdb", size=(640, 360), samples=64).save("cloud.png")

It needs Linux with glibc {glibc} or later and a driver of OpenGL 4.5, on a GPU or in software (Mesa, by EGL or OSMesa).
Everything else is in the wheel. NumPy is optional.
"""
WHEEL = """Wheel-Version: 1.0
Generator: cumulet
Root-Is-Purelib: false
Tag: {tag}
"""
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same files give the same wheel


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


def libraries(folder):
    """(name in the wheel, file): each library once, under the name that the loader requests."""
    for path in [*folder.glob("*.so.*"), *folder.glob("fallback/*")]:
        if not re.fullmatch(r"libcumulet.*\.so\.\d+\.\d+\.\d+", path.name):
            yield path.relative_to(folder).as_posix(), path


def record(name, data):
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--version", required=True)
    for option in ("--license", "--package", "--libraries", "--licenses", "--out"):
        parser.add_argument(option, required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    glibc = platform.libc_ver()[1] or os.confstr("CS_GNU_LIBC_VERSION").split()[-1]
    info = f"cumulet-{arguments.version}.dist-info"
    content = {f"cumulet/{path.name}": path.read_bytes() for path in sorted(arguments.package.iterdir())
               if path.suffix in (".py", ".pyi", ".typed")}
    content.update({f"cumulet/lib/{name}": path.read_bytes() for name, path in sorted(libraries(arguments.libraries))})
    content.update({f"{info}/licenses/{path.relative_to(arguments.licenses).as_posix()}": path.read_bytes()
                    for path in files(arguments.licenses)})
    content[f"{info}/LICENSE"] = arguments.license.read_bytes()
    content[f"{info}/METADATA"] = METADATA.format(version=arguments.version, glibc=glibc).encode()
    content[f"{info}/WHEEL"] = WHEEL.format(tag=TAG).encode()
    records = "".join(record(name, data) for name, data in content.items())
    content[f"{info}/RECORD"] = f"{records}{info}/RECORD,,\n".encode()
    out = arguments.out / f"cumulet-{arguments.version}-{TAG}.whl"
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.external_attr = 0o644 << 16
            wheel.writestr(entry, data, zipfile.ZIP_DEFLATED)
    print(f"{out}: {out.stat().st_size >> 20} MiB, for glibc {glibc} or later")


if __name__ == "__main__":
    main()
