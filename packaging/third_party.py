"""Writes the licences of everything that the programs are built from, with the texts.

    python3 packaging/third_party.py TARGET OUT.md

The packages are those of packaging/sbom.py; the texts are the files that the packages have in cargo's
folder of sources. A text that several packages share stands there once.
"""

import re
import sys
from pathlib import Path

from sbom import expression, linked

# How files with licences and notices are called, and how deep they lie (C sources inside a package).
NAMES = re.compile(r"(licen[cs]e|copying|copyright|notice|unlicense|ofl|ufl)", re.IGNORECASE)
DEPTH_MAX = 3
# Programs have these letters in their name too.
NO_TEXTS = re.compile(r"\.(rs|c|h|cpp|py|js|toml|json|yml|yaml|sh|png|svg|html)$", re.IGNORECASE)
TEXT_MAX = 200_000
# Folders of a package from which nothing is linked.
NOT_LINKED = {"benches", "examples", "programs", "test", "tests"}


def texts(folder):
    """Licence texts in a package's folder, each with its path there."""
    for path in sorted(folder.rglob("*")):
        place = path.relative_to(folder)
        is_meant = NAMES.match(path.name) or NAMES.fullmatch(place.parts[0])
        is_meant = is_meant and not NOT_LINKED.intersection(place.parts)
        if len(place.parts) > DEPTH_MAX or not is_meant or NO_TEXTS.search(path.name):
            continue
        if path.is_file() and path.stat().st_size < TEXT_MAX:
            yield str(place), path.read_text(errors="replace").strip()


def main():
    target, out = sys.argv[1:]
    packages, _ = linked(target)
    of_others = [package for package in packages if package["source"] is not None]
    # By its words: line ends and indents are no difference.
    shared, without = {}, []
    for package in of_others:
        found = list(texts(Path(package["manifest_path"]).parent))
        if not found:
            without.append(package)
        for place, text in found:
            name = f"{package['name']} {package['version']} ({place})"
            shared.setdefault(" ".join(text.split()), (text, []))[1].append(name)
    lines = [
        "# Licences of third parties",
        "",
        f"The programs of Softgrasp for {target} contain these packages, and the standard library of",
        "Rust (MIT OR Apache-2.0). Where a package lets one choose, Softgrasp uses it under one of the",
        "licences that its own file `deny.toml` allows; the other ones stand here as well, because the",
        "packages have them. The texts follow.",
        "",
        "| package | version | licence | from |",
        "|---|---|---|---|",
    ]
    for package in of_others:
        source = package["repository"] or package["homepage"] or ""
        row = (package["name"], package["version"], expression(package) or "see its text", source)
        lines.append("| " + " | ".join(row) + " |")
    if without:
        lines += ["", "These packages come without a text of their own. Their manifests say:", ""]
    for package in without:
        authors = ", ".join(package["authors"]) or "no authors named"
        lines.append(f"- {package['name']} {package['version']}: {expression(package)}; {authors}")
    for text, names in shared.values():
        fence = "````" if "```" in text else "```"
        lines += ["", "## " + ", ".join(names), "", fence, text, fence]
    Path(out).write_text("\n".join(lines) + "\n")
    told = f"{len(of_others)} packages, {len(shared)} texts"
    print(f"{told}, {len(without)} packages without a text in {out}")


if __name__ == "__main__":
    main()
