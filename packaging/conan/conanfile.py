"""Conan 2 recipe of libatlasfit: `conan create packaging/conan` in a clone. Needs cargo (Rust 1.95 or newer).
In: the sources around this file. Out: headers, the library, and targets for CMake."""

import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir

required_conan_version = ">=2.0"


class AtlasfitConan(ConanFile):
    name = "atlasfit"
    description = "Fits an atlas of smooth charts to a noisy 3D scan: denoised points, one surface, chart UVs"
    license = ("MIT", "Apache-2.0")
    url = homepage = "https://example.invalid/atlasfit"
    topics = ("point-cloud", "denoising", "surface-reconstruction", "uv-mapping")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False]}
    default_options = {"shared": True}

    def set_version(self):
        text = load(self, os.path.join(self.recipe_folder, "..", "..", "Cargo.toml"))
        self.version = self.version or re.search(r'^version = "(.+)"', text, re.M)[1]

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..")
        for pattern in ("Cargo.toml", "Cargo.lock", "LICENSE-*", ".cargo/*", "rust/*", "include/*", "cpp/*"):
            copy(self, pattern, root, self.export_sources_folder, excludes=("*/target/*", "*/build/*"))

    def layout(self):
        cmake_layout(self)

    def validate(self):
        if self.settings.os != "Linux":
            raise ConanInvalidConfiguration("atlasfit's CMake build is tested on Linux only")
        if self.settings.get_safe("compiler.cppstd"):
            check_min_cppstd(self, 17)

    def generate(self):
        toolchain = CMakeToolchain(self)
        # An absolute folder keeps what cargo built between packages of one machine.
        target = os.environ.get("CARGO_TARGET_DIR")
        if target:
            toolchain.cache_variables["ATLASFIT_TARGET_DIR"] = target
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure(build_script_folder="cpp")
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE-*", self.source_folder, os.path.join(self.package_folder, "licenses"))
        rmdir(self, os.path.join(self.package_folder, "share"))
        rmdir(self, os.path.join(self.package_folder, "lib", "cmake"))
        rmdir(self, os.path.join(self.package_folder, "lib", "pkgconfig"))
        unwanted = "libatlasfit.a" if self.options.shared else "libatlasfit.so*"
        for name in os.listdir(os.path.join(self.package_folder, "lib")):
            if name.startswith(unwanted.rstrip("*")):
                os.remove(os.path.join(self.package_folder, "lib", name))

    def package_info(self):
        self.cpp_info.libs = ["atlasfit"]
        self.cpp_info.set_property("cmake_file_name", "atlasfit")
        name = "atlasfit::atlasfit" if self.options.shared else "atlasfit::static"
        self.cpp_info.set_property("cmake_target_name", name)
        self.cpp_info.set_property("pkg_config_name", "atlasfit")
        self.cpp_info.system_libs = ["pthread", "dl", "m"]
