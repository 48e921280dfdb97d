"""The licences of all crates inside the program and the library, and the list of them for machines (SBOM).

In: what cargo knows of the workspace. Out: THIRD-PARTY-LICENCES.txt, and atlasfit.cdx.json in the form of
CycloneDX 1.5. Only crates that are linked are in: no build tools, no tests.
"""

import json
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Licences whose text must come along and that a permissive program may hold.
ALLOWED = {
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "Zlib",
    "ISC",
    "CC0-1.0",
    "Unicode-3.0",
    "MPL-2.0",
    "Unlicense",
    "0BSD",
    "BSL-1.0",
    "MIT-0",
    "OFL-1.1",
    "Ubuntu-font-1.0",
}
TEXTS = re.compile(r"^(licen[cs]e|copying|notice|unlicense|copyright)", re.I)


def linked(package, target):
    """(name, version) of all crates that are linked into a package, itself left out."""
    command = ["cargo", "tree", "--locked", "-p", package, "-e", "normal,no-proc-macro", "--target", target]
    out = subprocess.run(
        [*command, "--prefix", "none", "--no-dedupe", "-f", "{p}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = set()
    for line in out.splitlines():
        name, version = line.split()[:2]
        if not name.startswith("atlasfit"):
            found.add((name, version.removeprefix("v")))
    return found


def crates(target, packages=("atlasfit-cli", "atlasfit-capi")):
    """What cargo says of every crate inside, by name."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked"]
    known = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout)["packages"]
    inside = set().union(*(linked(p, target) for p in packages))
    found = [p for p in known if (p["name"], p["version"]) in inside]
    return sorted(found, key=lambda p: (p["name"], p["version"]))


def refused(expression):
    """Whether an SPDX expression leaves no choice of allowed licences only."""
    known = re.sub(
        r"[\w.+-]+( WITH [\w.+-]+)?",
        lambda name: {"AND": "and", "OR": "or"}.get(name[0], str(name[0] in ALLOWED)),
        (expression or "none").replace("/", " OR "),
    )
    return not eval(known)


def texts(crate):
    """The texts of a crate's licences, as they lie beside its manifest."""
    folder = Path(crate["manifest_path"]).parent
    named = [folder / crate["license_file"]] if crate.get("license_file") else []
    found = sorted(p for p in folder.iterdir() if p.is_file() and TEXTS.match(p.name))
    return [p.read_text(errors="replace").strip() for p in dict.fromkeys([*named, *found]) if p.is_file()]


def write(out, target, version):
    """Both files; fails where a licence is not allowed."""
    inside = crates(target)
    bad = [f"{c['name']}: {c['license']}" for c in inside if refused(c["license"])]
    if bad:
        raise SystemExit("licences that are not allowed in a permissive program: " + "; ".join(bad))
    shared = {}
    for crate in inside:
        for text in texts(crate) or ["(the crate names its licence and holds no text of it)"]:
            shared.setdefault(text, []).append(f"{crate['name']} {crate['version']}")
    lines = ["Libraries inside atlasfit, and their licences.\n"]
    lines += [f"  {c['name']} {c['version']}: {c['license']}" for c in inside]
    for text, names in shared.items():
        lines += ["\n" + "=" * 78, "\n".join(names), "-" * 78, text]
    (out / "THIRD-PARTY-LICENCES.txt").write_text("\n".join(lines) + "\n")
    lock = (ROOT / "Cargo.lock").read_text()
    components = []
    for crate in inside:
        name, number = crate["name"], crate["version"]
        found = re.search(
            rf'name = "{re.escape(name)}"\nversion = "{re.escape(number)}"\nsource = .*\nchecksum = "(\w+)"',
            lock,
        )
        component = {
            "type": "library",
            "bom-ref": f"pkg:cargo/{name}@{number}",
            "name": name,
            "version": number,
            "purl": f"pkg:cargo/{name}@{number}",
            "licenses": [{"expression": crate["license"].replace("/", " OR ")}],
        }
        if found:
            component["hashes"] = [{"alg": "SHA-256", "content": found[1]}]
        components.append(component)
    bom = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": f"pkg:cargo/atlasfit-cli@{version}",
                "name": "atlasfit",
                "version": version,
                "licenses": [{"expression": "MIT OR Apache-2.0"}],
            }
        },
        "components": components,
    }
    (out / "atlasfit.cdx.json").write_text(json.dumps(bom, indent=1) + "\n")
    return len(inside)
