#!/usr/bin/env python3
"""Lays the pages of the repository out as sources of one mdBook.

    site/pages.py FOLDER     writes the sources into FOLDER, which must be empty or not be there
    site/pages.py --check    looks whether every link of every page leads somewhere, and writes nothing

docs/SUMMARY.md is the list of pages. Pages lie in docs, in reports and in the root; in the book those of
docs lie in its root. Links between them are written anew for that. What is linked and is no page (pictures,
tables, licences) is copied beside them.
"""

import posixpath
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUMMARY = "docs/SUMMARY.md"
# Inline links and pictures; no page has others.
LINK = re.compile(r"(!?\[(?:[^\[\]]|\[[^\[\]]*\])*\])\(([^()\s]+)\)")
FENCE = re.compile(r"^\s*(```|~~~)")
# A README would become the index of its folder, and then there were two indices.
RENAMED = {"docs/README.md": "all-pages.md", "README.md": "project/overview.md"}


def place(path):
    """Where a file of the repository lies in the book."""
    if path in RENAMED:
        return RENAMED[path]
    if path.endswith("/README.md") and path != "reports/README.md":
        return path.removesuffix("/README.md").replace("/", "-") + ".md"
    if path == "reports/README.md":
        return "reports/index.md"
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if path.startswith("reports/"):
        return path
    if "/" not in path and path.endswith(".md"):
        return "project/" + path.lower()
    return "files/" + path


def slug(heading):
    """The anchor of a heading, as GitHub and mdBook make it."""
    heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    heading = re.sub(r"<[^>]*>", "", heading).strip().lower()
    return "".join(
        "-" if c.isspace() else c for c in heading if c.isalnum() or c.isspace() or c in "-_"
    )


def prose(text):
    """Lines with whether they are text, and not a block of code."""
    fenced = False
    for line in text.split("\n"):
        if FENCE.match(line):
            fenced = not fenced
            yield line, False
        else:
            yield line, not fenced


def anchors(text):
    """All anchors of a page; a heading that comes again is counted."""
    seen = {}
    found = set()
    for line, is_text in prose(text):
        heading = re.match(r"#{1,6}\s+(.*?)\s*#*$", line) if is_text else None
        if heading:
            name = slug(heading[1])
            count = seen.get(name, 0)
            seen[name] = count + 1
            found.add(name if count == 0 else f"{name}-{count}")
    return found


def outside_code(line, change):
    """The line with `change` of every piece that is not between backticks; a link may hold such a piece."""
    pieces = re.split(r"(`+[^`]*`+)", line)
    kept = [piece for piece in pieces[1::2]]
    marked = "".join(
        piece if i % 2 == 0 else f"\x00{i // 2}\x00" for i, piece in enumerate(pieces)
    )
    return re.sub(r"\x00(\d+)\x00", lambda m: kept[int(m[1])], change(marked))


class Book:
    """The pages of the list, and what they need beside them."""

    def __init__(self):
        self.texts = {}
        self.files = set()
        self.faults = []
        summary = (ROOT / SUMMARY).read_text("utf-8")
        for _, target in LINK.findall(summary):
            path = posixpath.normpath(posixpath.join("docs", target))
            if not (ROOT / path).is_file():
                self.faults.append(f"{SUMMARY}: there is no {path}")
            elif path in self.texts:
                self.faults.append(f"{SUMMARY}: {path} is listed twice")
            else:
                self.texts[path] = (ROOT / path).read_text("utf-8")
        for folder in ("docs", "reports"):
            for page in sorted((ROOT / folder).glob("*.md")):
                path = f"{folder}/{page.name}"
                if path not in self.texts and path != SUMMARY:
                    self.faults.append(f"{SUMMARY} does not list {path}")
        self.anchors = {path: anchors(text) for path, text in self.texts.items()}

    def target(self, page, link):
        """What a link of a page becomes; None where only its words can stay."""
        if re.match(r"[a-z][a-z0-9+.-]*:", link):
            return link
        name, _, anchor = link.partition("#")
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page), name)) if name else page
        if anchor and path in self.anchors and anchor not in self.anchors[path]:
            self.faults.append(f"{page}: {path} has no heading #{anchor}")
        if not name:
            return link
        if path not in self.texts:
            if (ROOT / path).is_dir():
                return None
            if not (ROOT / path).is_file():
                self.faults.append(f"{page}: there is no {path}")
                return link
            if path.endswith(".md"):
                self.faults.append(f"{page}: {path} is linked, and {SUMMARY} does not list it")
            self.files.add(path)
        way = posixpath.relpath(place(path), posixpath.dirname(place(page)) or ".")
        return way + ("#" + anchor if anchor else "")

    def mended(self, page):
        """Text of a page with its links written for the book."""

        def link(match):
            target = self.target(page, match[2])
            if target is None:
                return match[1].removeprefix("[").removesuffix("]")
            return f"{match[1]}({target})"

        lines = []
        for line, is_text in prose(self.texts[page]):
            lines.append(outside_code(line, lambda text: LINK.sub(link, text)) if is_text else line)
        return "\n".join(lines)

    def write(self, folder):
        """Writes all sources."""
        pages = {page: self.mended(page) for page in self.texts}
        summary = (ROOT / SUMMARY).read_text("utf-8")
        summary = LINK.sub(lambda m: f"{m[1]}({place(self.resolved(m[2]))})", summary)
        places = [place(path) for path in [*pages, *self.files]]
        twice = {name for name in places if places.count(name) > 1}
        self.faults.extend(f"two files would become {name}" for name in sorted(twice))
        if folder is None:
            return
        for page, text in pages.items():
            file = folder / place(page)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, "utf-8")
        for path in sorted(self.files):
            file = folder / place(path)
            file.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / path, file)
        (folder / "SUMMARY.md").write_text(summary, "utf-8")

    @staticmethod
    def resolved(target):
        """Path in the repository of a target of the list."""
        return posixpath.normpath(posixpath.join("docs", target))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    book = Book()
    is_check = sys.argv[1] == "--check"
    folder = None if is_check else Path(sys.argv[1])
    if folder is not None and folder.exists() and any(folder.iterdir()):
        sys.exit(f"{folder} is not empty")
    book.write(folder)
    if book.faults:
        sys.exit("\n".join(sorted(set(book.faults))))
    print(f"{len(book.texts)} pages, {len(book.files)} other files: every link leads somewhere")


if __name__ == "__main__":
    main()
