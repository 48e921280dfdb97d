"""Archives that are the same bytes for the same files: tar.gz and Debian's .deb.

In: names and bytes, or a folder. Out: files.
"""

import gzip
import hashlib
import io
import subprocess
import tarfile
from pathlib import Path

# Seconds since 1970 of every entry, so that two builds of one commit are the same: 1 January 2020.
WHEN = 1577836800


def tree(folder):
    """{name: path} of all files and links under a folder, in order."""
    return {
        path.relative_to(folder).as_posix(): path
        for path in sorted(folder.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


def tar(path, folder, inside):
    """All of `folder` as a .tar.gz that unpacks to the folder `inside`."""
    raw = io.BytesIO()
    with tarfile.open(fileobj=raw, mode="w", format=tarfile.GNU_FORMAT) as archive:
        for name, file in tree(folder).items():
            entry = archive.gettarinfo(file, f"{inside}/{name}")
            entry.mtime, entry.uid, entry.gid, entry.uname, entry.gname = WHEN, 0, 0, "root", "root"
            if entry.isreg():
                entry.mode = 0o755 if file.stat().st_mode & 0o100 else 0o644
                with file.open("rb") as content:
                    archive.addfile(entry, content)
            else:
                archive.addfile(entry)
    path.write_bytes(gzip.compress(raw.getvalue(), 9, mtime=WHEN))
    return path


def gz(path, text):
    """Text as a .gz file, as Debian wants manual pages and changelogs."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text if isinstance(text, bytes) else text.encode(), 9, mtime=0))


def deb(folder, control, out, extra=()):
    """A .deb of `folder`, whose files lie where they are installed. `control`: fields; `extra`: more files of
    the control archive, {name: text}."""
    area = folder / "DEBIAN"
    area.mkdir()
    files = {name: p for name, p in tree(folder).items() if not name.startswith("DEBIAN/")}
    size = sum(p.lstat().st_size for p in files.values()) // 1024 + 1
    fields = {**control, "Installed-Size": str(size)}
    # The description comes last: it has lines of its own.
    fields["Description"] = fields.pop("Description")
    (area / "control").write_text("".join(f"{k}: {v}\n" for k, v in fields.items()))
    sums = "".join(
        f"{hashlib.md5(p.read_bytes()).hexdigest()}  {name}\n"
        for name, p in files.items()
        if not p.is_symlink()
    )
    (area / "md5sums").write_text(sums)
    for name, text in dict(extra).items():
        (area / name).write_text(text)
    for path in [folder, *folder.rglob("*")]:
        if not path.is_symlink():
            # A shared library is no program.
            program = path.is_dir() or (path.stat().st_mode & 0o100 and ".so" not in path.name)
            path.chmod(0o755 if program else 0o644)
    name = f"{control['Package']}_{control['Version']}_{control['Architecture']}.deb"
    command = ["dpkg-deb", "--root-owner-group", "-Zxz", "--build", str(folder), str(out / name)]
    subprocess.run(
        command,
        check=True,
        stdout=subprocess.DEVNULL,
        env={"PATH": "/usr/bin:/bin", "SOURCE_DATE_EPOCH": str(WHEN)},
    )
    return out / name


def checksums(folder):
    """SHA256SUMS of all files of a folder."""
    lines = [
        f"{hashlib.sha256(p.read_bytes()).hexdigest()}  {p.name}\n"
        for p in sorted(folder.iterdir())
        if p.is_file() and p.name != "SHA256SUMS"
    ]
    (folder / "SHA256SUMS").write_text("".join(lines))


def strip(source, target):
    """A program or library without symbols that nobody needs to run it."""
    Path(target).parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["strip", "--strip-unneeded", "-o", str(target), str(source)], check=True)
    Path(target).chmod(0o755)
    return Path(target)
