#!/usr/bin/env python3
"""Whether every link of a folder of HTML leads somewhere in it: file and anchor.

    site/links.py FOLDER

Ends with 1 and a line for each link that does not. Links to other hosts are counted and not followed.
Needs nothing but Python 3.
"""

import os
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes that name another file.
LINKS = {"href", "src", "poster", "data"}


class Page(HTMLParser):
    """Links and anchors of one page."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.links = []
        self.anchors = set()
        self.repeated = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if value is None:
                continue
            if name == "id" or (name == "name" and tag == "a"):
                if name == "id" and value in self.anchors:
                    self.repeated.append(value)
                self.anchors.add(value)
            elif name in LINKS:
                self.links.append(value)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    root = Path(sys.argv[1]).resolve()
    pages = {
        path: Page(path.read_text("utf-8"))
        for path in sorted(root.rglob("*.html"))
        # Shown beside every page by a frame; its links are those of the page around it.
        if path.name != "toc.html"
    }
    if not pages:
        sys.exit(f"there is no page in {root}")
    faults = []
    inside = outside = 0
    for path, page in pages.items():
        name = path.relative_to(root)
        # The page of an address that is not there is shown at any address: its links begin at the host.
        base = root if path.name == "404.html" else path.parent
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                outside += 1
                continue
            inside += 1
            target = path
            if parts.path.startswith("/"):
                target = root / unquote(parts.path).lstrip("/")
            elif parts.path:
                target = Path(os.path.normpath(base / unquote(parts.path)))
            if target.is_dir():
                target = target / "index.html"
            if target != root and root not in target.parents:
                faults.append(f"{name}: {link} leads out of the folder")
            elif not target.is_file():
                faults.append(f"{name}: there is no {link}")
            elif parts.fragment and target in pages:
                if unquote(parts.fragment) not in pages[target].anchors:
                    faults.append(f"{name}: {link} names no anchor of that page")
        faults.extend(f"{name}: the anchor {anchor} stands twice" for anchor in page.repeated)
    if faults:
        sys.exit("\n".join(sorted(set(faults))))
    print(f"{len(pages)} pages, {inside} links inside, {outside} to other hosts: all inside lead somewhere")


if __name__ == "__main__":
    main()
