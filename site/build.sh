#!/usr/bin/env bash
# Makes the site out of docs, reports and the pages of the root, and looks where its links lead.
#
#   site/build.sh [FOLDER]            into FOLDER (default: out/site), which is emptied first
#   MDBOOK=path/to/mdbook site/build.sh     takes an mdbook that is not on the PATH
#
# Needs python3 and mdbook (cargo install mdbook).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mdbook="${MDBOOK:-mdbook}"
folder="${1:-out/site}"
command -v "$mdbook" >/dev/null || { echo "site: there is no $mdbook (cargo install mdbook)" >&2; exit 1; }

# Only what is empty or was made by this script is emptied.
if [ -e "$folder" ] && [ -n "$(ls -A "$folder")" ] && [ ! -e "$folder/.softgrasp-site" ]; then
    echo "site: $folder holds something else" >&2
    exit 1
fi
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

cp site/book.toml site/site.css "$work"
python3 site/pages.py "$work/src"
# Warnings of mdbook are faults of pages: an element that is not closed, a page that is not there.
"$mdbook" build "$work" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
if grep -E 'WARN|ERROR' "$work/log" >&2; then
    echo "site: mdbook warns" >&2
    exit 1
fi
python3 site/links.py "$work/html"

mkdir -p "$folder"
find "$folder" -mindepth 1 -delete
cp -R "$work/html/." "$folder"
touch "$folder/.softgrasp-site"
echo "site: $(du -sh "$folder" | cut -f1) in $folder"
