#!/usr/bin/env python3
"""Builds what is handed out, for the platform it runs on:

    package.py [--library FILE] [--out DIR]

    atlasfit-VERSION-py3-none-PLATFORM.whl        the Python package with the native library
    atlasfit_blender-VERSION-legacy-PLATFORM.zip  the add-on for Blender 3.4 to 4.1
    atlasfit_blender-VERSION-PLATFORM.zip         the extension for Blender 4.2 and later

Without --library cargo builds it. pip uses this file too (PEP 517, PEP 660): `pip install
./blender-addon`, or with -e to work on the package where it lies.
"""

import argparse
import base64
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
LIBRARY = {"win32": "atlasfit.dll", "darwin": "libatlasfit.dylib"}.get(sys.platform, "libatlasfit.so")
ADDON = "atlasfit_blender"
# Licences of the crates inside the library: written by packaging/dist.
THIRD_PARTY = "THIRD-PARTY-LICENCES.txt"
VERSION = ".".join(
    re.search(r"VERSION = \((\d+), (\d+), (\d+)\)", (HERE / "atlasfit" / "_abi.py").read_text()).groups()
)


def machine():
    """x86_64 or arm64, whatever the system calls it."""
    return {"amd64": "x86_64", "aarch64": "arm64"}.get(platform.machine().lower(), platform.machine().lower())


def wheel_platform(library):
    """The wheel's platform tag. On Linux it is the newest glibc symbol that the library asks for."""
    if sys.platform == "win32":
        return {"x86_64": "win_amd64", "arm64": "win_arm64"}[machine()]
    if sys.platform == "darwin":
        return f"macosx_11_0_{machine()}"
    glibc = max(int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", library))
    return f"manylinux_2_{glibc}_{platform.machine()}"


def blender_platform():
    """Blender's name for this platform."""
    system = {"win32": "windows", "darwin": "macos"}.get(sys.platform, "linux")
    return f"{system}-{'x64' if machine() == 'x86_64' else 'arm64'}"


def cargo_library():
    """The library, built by cargo."""
    if not shutil.which("cargo"):
        wrong = "atlasfit has no wheel for this platform, and to build it cargo is missing"
        sys.exit(f"{wrong}: install Rust (rustup.rs)")
    subprocess.run(
        ["cargo", "build", "--release", "--locked", "--package", "atlasfit-capi"], cwd=ROOT, check=True
    )
    name = LIBRARY.replace("atlasfit", "atlasfit_capi")
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / name


def sources(folder):
    """(name in an archive, bytes) of a folder's own files."""
    return [
        (f"{folder}/{path.relative_to(HERE / folder).as_posix()}", path.read_bytes())
        for path in sorted((HERE / folder).rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts and path.name != LIBRARY
    ]


def write_zip(path, files):
    """An archive of (name, bytes), the same bytes for the same files."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files:
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return path


def metadata():
    """What PyPI and pip know of the package."""
    return (
        f"Metadata-Version: 2.4\nName: atlasfit\nVersion: {VERSION}\n"
        "Summary: Fits an atlas of smooth charts to a noisy 3D scan: denoised points, one surface, "
        "low-stretch UVs\n"
        "License-Expression: MIT OR Apache-2.0\nLicense-File: LICENSE-MIT\nLicense-File: LICENSE-APACHE\n"
        "Requires-Python: >=3.9\nRequires-Dist: numpy>=1.22\n"
    )


def wheel(library, third_party, out, editable=False):
    """The Python package as a platform wheel; an editable one names this folder instead of holding its files.
    `third_party`: the licences of what is inside the library, or None.
    """
    tag = f"py3-none-{wheel_platform(library)}"
    info = f"atlasfit-{VERSION}.dist-info"
    if editable:
        files = [(f"__editable__.atlasfit-{VERSION}.pth", f"{HERE}\n".encode())]
    else:
        files = sources("atlasfit") + [(f"atlasfit/{LIBRARY}", library)]
    files += [
        (f"{info}/licenses/{name}", (ROOT / name).read_bytes()) for name in ("LICENSE-MIT", "LICENSE-APACHE")
    ]
    about = metadata()
    if third_party:
        files.append((f"{info}/licenses/{THIRD_PARTY}", third_party))
        about += f"License-File: {THIRD_PARTY}\n"
    files += [
        (f"{info}/METADATA", about.encode()),
        (
            f"{info}/WHEEL",
            f"Wheel-Version: 1.0\nGenerator: package.py\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(),
        ),
    ]
    record = ""
    for name, content in files:
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    files.append((f"{info}/RECORD", (record + f"{info}/RECORD,,\n").encode()))
    return write_zip(out / f"atlasfit-{VERSION}-{tag}.whl", files)


def legacy(library, third_party, out):
    """The add-on with the package inside its folder."""
    files = sources(ADDON) + [(f"{ADDON}/{name}", content) for name, content in sources("atlasfit")]
    files.append((f"{ADDON}/atlasfit/{LIBRARY}", library))
    if third_party:
        files.append((f"{ADDON}/{THIRD_PARTY}", third_party))
    return write_zip(out / f"{ADDON}-{VERSION}-legacy-{blender_platform()}.zip", files)


def extension(wheel_path, out):
    """The extension with the wheel inside. Its files are in a folder, so that an older Blender, which takes
    it for an add-on, keeps them together, and the add-on can say what to install instead (native.py).
    """
    files = []
    for name, content in sources(ADDON):
        if name.endswith("blender_manifest.toml"):
            text = content.decode().replace(
                "# package.py adds `platforms` and `wheels`.\n",
                f'platforms = ["{blender_platform()}"]\nwheels = ["./wheels/{wheel_path.name}"]\n',
            )
            content = text.encode()
        files.append((name, content))
    files.append((f"{ADDON}/wheels/{wheel_path.name}", wheel_path.read_bytes()))
    return write_zip(out / f"{ADDON}-{VERSION}-{blender_platform()}.zip", files)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """PEP 517."""
    return wheel(cargo_library().read_bytes(), None, Path(wheel_directory)).name


def build_sdist(sdist_directory, config_settings=None):
    """PEP 517: what cargo and this file need, as a clone has it."""
    sys.path.insert(0, str(ROOT / "packaging"))
    import archives

    wanted = "Cargo.toml Cargo.lock .cargo rust include LICENSE-MIT LICENSE-APACHE README.md".split()
    ours = ["blender-addon/package.py", "blender-addon/atlasfit"]
    command = ["git", "ls-files", *wanted, *ours]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    name = f"atlasfit-{VERSION}"
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for path in listed.splitlines():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, folder / path)
        (folder / "PKG-INFO").write_text(metadata())
        (folder / "pyproject.toml").write_text(
            '[build-system]\nrequires = []\nbuild-backend = "package"\nbackend-path = ["blender-addon"]\n'
        )
        return archives.tar(Path(sdist_directory) / f"{name}.tar.gz", folder, name).name


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """PEP 660: `pip install -e`. The library that cargo built is copied beside the package's files."""
    library = cargo_library().read_bytes()
    (HERE / "atlasfit" / LIBRARY).write_bytes(library)
    return wheel(library, None, Path(wheel_directory), editable=True).name


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--library", type=Path, help="the native library, where it is built already")
    parser.add_argument(
        "--out", type=Path, default=HERE / "dist", help="folder to write to (default: dist beside this file)"
    )
    arguments = parser.parse_args()
    library = (arguments.library or cargo_library()).read_bytes()
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = wheel(library, None, arguments.out)
    for made in (path, legacy(library, None, arguments.out), extension(path, arguments.out)):
        print(made)


if __name__ == "__main__":
    main()
