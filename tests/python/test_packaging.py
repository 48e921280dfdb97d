"""What packaging/ is made of, as far as it needs no build: licences, archives, the documents' links. The
packages themselves: packaging/nightly."""

import importlib.util
import json
import re
import subprocess
import sys
import tarfile

import pytest
from conftest import ROOT

PACKAGING = ROOT / "packaging"
VERSION = re.search(r'^version = "(.+)"', (ROOT / "Cargo.toml").read_text(), re.M)[1]


def module(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_every_crate_inside_has_a_permissive_licence_and_its_text_comes_along(tmp_path):
    licences = module(PACKAGING / "licences.py")
    count = licences.write(tmp_path, "x86_64-unknown-linux-gnu", VERSION)
    bom = json.loads((tmp_path / "atlasfit.cdx.json").read_text())
    names = {c["name"] for c in bom["components"]}
    assert len(bom["components"]) == count > 50
    assert {"rayon", "clap", "nalgebra"} <= names and not {"criterion", "proptest"} & names
    assert all(c["hashes"] for c in bom["components"])
    text = (tmp_path / "THIRD-PARTY-LICENCES.txt").read_text()
    assert all(f"  {name} " in text for name in names)
    assert licences.refused("GPL-3.0-only") and licences.refused(None)
    assert not licences.refused("GPL-3.0-only OR MIT") and licences.refused("MIT AND GPL-3.0-only")
    assert licences.refused("(MIT OR Apache-2.0) AND GPL-3.0-only")
    assert not licences.refused("(GPL-3.0-only OR MIT) AND Apache-2.0 WITH LLVM-exception")


def test_an_archive_has_the_same_bytes_for_the_same_files(tmp_path):
    archives = module(PACKAGING / "archives.py")
    made = []
    for name in ("a", "b"):
        folder = tmp_path / name
        (folder / "bin").mkdir(parents=True)
        (folder / "bin" / "run").write_text("#!/bin/sh\n")
        (folder / "bin" / "run").chmod(0o700 if name == "a" else 0o755)
        (folder / "link").symlink_to("bin/run")
        made.append(archives.tar(tmp_path / f"{name}.tar.gz", folder, "inside").read_bytes())
    assert made[0] == made[1]
    with tarfile.open(tmp_path / "a.tar.gz") as archive:
        assert archive.getnames() == ["inside/bin/run", "inside/link"]
        assert archive.getmember("inside/bin/run").mode == 0o755


def test_the_sdist_holds_what_cargo_needs_and_says_what_is_missing_without_it(tmp_path):
    package = module(ROOT / "blender-addon" / "package.py")
    source = tmp_path / package.build_sdist(tmp_path)
    with tarfile.open(source) as archive:
        archive.extractall(tmp_path, filter="data") if sys.version_info >= (3, 12) else archive.extractall(
            tmp_path
        )
    inside = tmp_path / f"atlasfit-{VERSION}"
    done = subprocess.run(
        ["cargo", "metadata", "--no-deps", "--locked", "--offline", "--format-version", "1"],
        cwd=inside, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (inside / "PKG-INFO").read_text().startswith("Metadata-Version")
    code = "import package, os; os.environ['PATH'] = ''; package.build_wheel('.')"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=inside / "blender-addon", capture_output=True, text=True
    )
    assert done.returncode and len(done.stderr.splitlines()) == 1 and "cargo is missing" in done.stderr


def test_the_vcpkg_port_and_the_conan_recipe_name_our_version():
    port = json.loads((PACKAGING / "vcpkg/atlasfit/vcpkg.json").read_text())
    assert port["version-semver"] == VERSION
    assert "Cargo.toml" in (PACKAGING / "conan/conanfile.py").read_text()


def test_every_link_of_the_documents_leads_somewhere(tmp_path):
    done = subprocess.run([PACKAGING / "site/build", tmp_path / "site"], capture_output=True, text=True)
    if "No matching distribution" in done.stderr:
        pytest.skip("mkdocs cannot be installed here")
    assert done.returncode == 0, done.stderr[-3000:]
    assert (tmp_path / "site/docs/questions.html").is_file()
