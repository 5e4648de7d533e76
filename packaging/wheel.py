"""Writes a wheel with both programs, which pip lays beside its own: softgrasp-bin.

    python3 packaging/wheel.py BIN_DIR LICENCES_DIR VERSION OUT_DIR

BIN_DIR has the programs, LICENCES_DIR the texts that go along. Python's standard library is all that is
needed. The name says on which systems the programs run: the oldest C library that has all they ask for.
SOURCE_DATE_EPOCH sets the time of the files.
"""

import base64
import hashlib
import os
import re
import sys
import sysconfig
import time
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROGRAMS = ("fea-server", "glove-client")
LICENCES = ("LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY-LICENSES.md")


def platform(programs):
    """The platform in the wheel's name."""
    name = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    if not name.startswith("linux_"):
        return name
    asked = [int(number) for program in programs for number in versions(program)]
    if not asked:
        sys.exit("the programs do not ask for the GNU C library: the wheel has no name for that")
    return f"manylinux_2_{max(asked)}_{name.removeprefix('linux_')}"


def versions(program):
    """Second numbers of the versions of the GNU C library that a program names (PEP 600)."""
    return re.findall(rb"\0GLIBC_2\.(\d+)", program.read_bytes())


def metadata(version):
    fields = [
        "Metadata-Version: 2.4",
        "Name: softgrasp-bin",
        f"Version: {version}",
        "Summary: The programs of Softgrasp: finite element server, and client for glove and mouse",
        "License-Expression: MIT OR Apache-2.0",
        *(f"License-File: {name}" for name in LICENCES),
        "Requires-Python: >=3.10",
        "Classifier: Topic :: Scientific/Engineering",
        "Description-Content-Type: text/markdown",
    ]
    return "\n".join(fields) + "\n\n" + (HERE / "softgrasp-bin/README.md").read_text()


def main():
    programs_dir, licences_dir, version, out = sys.argv[1:]
    programs = [Path(programs_dir, name) for name in PROGRAMS]
    tag = f"py3-none-{platform(programs)}"
    stem = f"softgrasp_bin-{version}"
    about = f"{stem}.dist-info"
    files = [(f"{stem}.data/scripts/{p.name}", p.read_bytes(), 0o755) for p in programs]
    for name in LICENCES:
        files.append((f"{about}/licenses/{name}", Path(licences_dir, name).read_bytes(), 0o644))
    files.append((f"{about}/METADATA", metadata(version).encode(), 0o644))
    wheel = f"Wheel-Version: 1.0\nGenerator: packaging/wheel.py\nRoot-Is-Purelib: false\nTag: {tag}\n"
    files.append((f"{about}/WHEEL", wheel.encode(), 0o644))
    rows = [row(name, content) for name, content, _ in files]
    rows.append(f"{about}/RECORD,,\n")
    files.append((f"{about}/RECORD", "".join(rows).encode(), 0o644))
    # A zip has no time before 1980.
    seconds = max(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())), 315_619_200)
    path = Path(out, f"{stem}-{tag}.whl")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content, mode in files:
            entry = zipfile.ZipInfo(name, time.gmtime(seconds)[:6])
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    print(path)


def row(name, content):
    """Line of RECORD: name, digest, length."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


if __name__ == "__main__":
    main()
