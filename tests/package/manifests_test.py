"""Checks the vcpkg port and the Conan recipe without these tools: the manifests parse, and their version, license,
features and options are those of the project. Both name every package that CMake finds.

Usage: manifests_test.py SOURCE_DIR"""

import ast
import fnmatch
import json
import re
import sys
from pathlib import Path

# Packages, headers and libraries that CMake finds, and their names in vcpkg and in Conan. None: part of no package.
PACKAGES = {
    "JPEG": ("libjpeg-turbo", "libjpeg-turbo"),
    "OpenEXR": ("openexr", "openexr"),
    "OpenVDB": ("openvdb", "openvdb"),
    "PkgConfig": None,
    "TBB": ("tbb", "onetbb"),
    "TIFF": ("tiff", "libtiff"),
    "Threads": None,
    "TinyGLTF": ("tinygltf", "tinygltf"),
    "WebP": ("libwebp", "libwebp"),
    "ZLIB": ("zlib", "zlib"),
    "blosc": ("blosc", "c-blosc"),
    "blosc.h": ("blosc", "c-blosc"),
    "draco": ("draco", "draco"),
    "FindOpenVDB.cmake": ("openvdb", "openvdb"),
    "glm/glm.hpp": ("glm", "glm"),
    "glslangValidator": None,
    "meshoptimizer": ("meshoptimizer", "meshoptimizer"),
    "nanovdb/NanoVDB.h": ("openvdb", "openvdb"),
    "nlohmann/json.hpp": ("nlohmann-json", "nlohmann_json"),
    "python3": None,
    "stb_image_write.h": ("stb", "stb"),
    "tiny_gltf.h": ("tinygltf", "tinygltf"),
}
LICENSES = {"BSD 3-Clause License": "BSD-3-Clause"}
# Features of the project that Conan's packages cannot provide.
NOT_IN_CONAN = {"nanovdb"}

failures = []


def expect(condition, text):
    if not condition:
        failures.append(text)


def found_by_cmake(source):
    """Returns the names that the build of the library finds."""
    text = "".join((source / "cmake" / name).read_text() for name in ("CumuletLibraries.cmake", "CumuletDependencies.cmake"))
    text = re.sub(r"#.*", "", text)
    names = re.findall(r"find_package\((\w+)", text)
    names += re.findall(r"cumulet_find_by_config\(\w+ (\w+)", text)
    names += re.findall(r"find_(?:path|program|library)\(\w+\s+(?:NAMES )?([\w./]+)", text)
    return sorted(set(names))


def vcpkg_dependencies(manifest):
    """Returns the names of all dependencies, with those of the features."""
    lists = [manifest["dependencies"], *(feature["dependencies"] for feature in manifest["features"].values())]
    return {entry if isinstance(entry, str) else entry["name"] for entries in lists for entry in entries}


def check_vcpkg(source, project, wanted):
    folder = source / "packaging/vcpkg/cumulet"
    manifest = json.loads((folder / "vcpkg.json").read_text())
    expect(manifest["name"] == folder.name, "vcpkg.json: the name is not that of its folder")
    expect(manifest["version"] == project["version"], f"vcpkg.json: version {manifest['version']}")
    expect(manifest["description"] == project["description"], "vcpkg.json: the description is another one")
    expect(manifest["license"] == project["license"], f"vcpkg.json: license {manifest['license']}")
    expect(set(manifest["features"]) == project["features"], f"vcpkg.json: features {sorted(manifest['features'])}")
    expect(set(manifest["default-features"]) <= set(manifest["features"]), "vcpkg.json: unknown default features")
    named = vcpkg_dependencies(manifest)
    for names in wanted:
        expect(names[0] in named, f"vcpkg.json does not name {names[0]}")
    port = (folder / "portfile.cmake").read_text()
    for option in re.findall(r"\bCUMULET_\w+", port):
        expect(option in project["options"], f"portfile.cmake: there is no option {option}")
    for feature in manifest["features"]:
        expect(f"{feature} CUMULET_{feature.upper()}" in port, f"portfile.cmake ignores the feature {feature}")


def installed_paths(source):
    """Returns the files and folders of the tree that every build installs: those of commands outside conditions."""
    text = re.sub(r"#.*", "", (source / "cmake/Packaging.cmake").read_text())
    paths = []
    for command in re.findall(r"^install\(([^)]*)\)", text, re.MULTILINE):
        if "OPTIONAL" not in command.split():
            paths += re.findall(r"\$\{PROJECT_SOURCE_DIR\}/([\w./-]+)", command)
    return paths


def is_exported(path, globs):
    """Conan's patterns are those of fnmatch: * matches slashes, too."""
    return any(fnmatch.fnmatch(name, glob) for glob in globs for name in (path, path.rstrip("/") + "/x"))


def check_conan(source, project, wanted):
    text = (source / "packaging/conan/conanfile.py").read_text()
    tree = ast.parse(text)
    values = {}
    for node in [*tree.body, *(n for c in tree.body if isinstance(c, ast.ClassDef) for n in c.body)]:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            try:
                values[node.targets[0].id] = ast.literal_eval(node.value)
            except ValueError:
                pass
    expect(values["description"] == project["description"], "conanfile.py: the description is another one")
    expect(values["license"] == project["license"], f"conanfile.py: license {values['license']}")
    pattern = re.search(r're\.search\(r"(.*?)", \(TREE', text)[1]
    found = re.search(pattern, (source / "CMakeLists.txt").read_text())
    expect(found is not None and found[1] == project["version"], "conanfile.py reads another version")
    requirements = values["REQUIREMENTS"]
    features = {feature for feature in requirements if feature}
    expect(features == project["features"] - NOT_IN_CONAN, f"conanfile.py: features {sorted(features)}")
    named = set()
    for package in (entry for entries in requirements.values() for entry in entries):
        expect(re.fullmatch(r"[\w-]+/\[[^\]]+\]", package), f"conanfile.py: {package} is no requirement")
        named.add(package.split("/")[0])
    for names in wanted:
        expect(names[1] in named, f"conanfile.py does not name {names[1]}")
    for glob in values["SOURCES"]:
        expect(any(source.glob(glob)), f"conanfile.py: {glob} matches no file")
    installed = installed_paths(source)
    expect("demo/embed/" in installed, f"Packaging.cmake installs {installed}, without the example hosts")
    for path in installed:
        expect(is_exported(path, values["SOURCES"]), f"conanfile.py does not export {path}, which is installed")
    for option in re.findall(r'variables\["(CUMULET_\w+)"\]', text):
        expect(option in project["options"], f"conanfile.py: there is no option {option}")


def main():
    source = Path(sys.argv[1])
    cmake = (source / "CMakeLists.txt").read_text()
    options = set(re.findall(r"option\((CUMULET_\w+)", cmake))
    project = {
        "version": re.search(r"project\(Cumulet VERSION ([\d.]+)", cmake)[1],
        "description": re.search(r'DESCRIPTION "([^"]+)"', cmake)[1],
        "license": LICENSES[(source / "LICENSE").read_text().splitlines()[0]],
        "options": options,
        "features": {name[8:].lower() for name in re.findall(r'option\((CUMULET_\w+) "Read ', cmake)},
    }
    names = found_by_cmake(source)
    expect(len(names) > 10, f"CMake finds only {names}")
    for name in names:
        expect(name in PACKAGES, f"CMake finds {name}, which this test does not know: add it to PACKAGES")
    wanted = [PACKAGES[name] for name in names if PACKAGES.get(name)]
    check_vcpkg(source, project, wanted)
    check_conan(source, project, wanted)
    for failure in failures:
        print(f"manifests_test: {failure}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
