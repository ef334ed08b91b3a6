"""Conan 2 recipe of libcumulet. It builds the source tree that contains it, without the programs."""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy

required_conan_version = ">=2.0"
TREE = Path(__file__).resolve().parents[2]
SOURCES = ("CMakeLists.txt", "LICENSE", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "cmake/*", "demo/embed/*",
           "docs/*", "glsl/*", "src/*", "third_party_notes/*")

# Packages by the CMake option that needs them; None: always.
REQUIREMENTS = {
    None: ["c-blosc/[>=1.21 <2]", "glm/[>=0.9.9 <2]", "libjpeg-turbo/[>=2 <4]", "nlohmann_json/[>=3.11 <4]",
           "onetbb/[>=2021.8 <2023]", "openexr/[>=3.1 <4]", "stb/[*]", "tinygltf/[>=2.5 <3]", "zlib/[>=1.2.13 <2]"],
    "draco": ["draco/[>=1.5 <2]"],
    "meshopt": ["meshoptimizer/[>=0.18 <1]"],
    "openvdb": ["openvdb/[>=10 <14]"],
    "tiff": ["libtiff/[>=4.5 <5]"],
    "webp": ["libwebp/[>=1.3.2 <2]"],
}


class CumuletRecipe(ConanFile):
    name = "cumulet"
    description = "Embeddable path-traced volumes on an adaptive tetrahedral grid"
    license = "BSD-3-Clause"
    topics = ("volume-rendering", "path-tracing", "opengl", "openvdb")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False]}
    options.update({feature: [True, False] for feature in REQUIREMENTS if feature})
    default_options = {"shared": True, "fPIC": True}
    default_options.update({feature: True for feature in REQUIREMENTS if feature})

    def set_version(self):
        self.version = re.search(r"project\(Cumulet VERSION ([\d.]+)", (TREE / "CMakeLists.txt").read_text())[1]

    def export_sources(self):
        for pattern in SOURCES:
            copy(self, pattern, TREE, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        for feature, packages in REQUIREMENTS.items():
            if feature is None or self.options.get_safe(feature):
                for package in packages:
                    self.requires(package)

    def build_requirements(self):
        self.tool_requires("cmake/[>=3.25]")

    def generate(self):
        deps = CMakeDeps(self)
        deps.generate()
        toolchain = CMakeToolchain(self)
        variables = toolchain.cache_variables
        variables["CUMULET_STATIC"] = not self.options.shared
        # Conan's packages have CMake files, and its openvdb has no NanoVDB.
        variables["CUMULET_PKG_CONFIG"] = False
        variables["CUMULET_NANOVDB"] = False
        for feature in filter(None, REQUIREMENTS):
            variables[f"CUMULET_{feature.upper()}"] = bool(self.options.get_safe(feature))
        for part in ("BUILD_APPS", "BUILD_HOSTS", "BUILD_TESTS", "BUILD_BENCH", "WERROR"):
            variables[f"CUMULET_{part}"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, Path(self.package_folder) / "licenses")
        CMake(self).install()

    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")  # Cumulet installs its own CMake package
        self.cpp_info.builddirs = ["lib/cmake/Cumulet"]
        self.cpp_info.libs = ["cumulet"]
        if not self.options.shared:
            self.cpp_info.defines = ["CUMULET_STATIC"]
