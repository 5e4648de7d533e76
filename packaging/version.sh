#!/usr/bin/env bash
# Whether every place that names the version names that of a tag, and what the changelog says of it.
#
#   packaging/version.sh v0.2.0            ends with 1 and a line for each place that says otherwise
#   packaging/version.sh --notes v0.2.0    prints the changelog's section of that version
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

notes=no
if [ "${1:-}" = --notes ]; then
    notes=yes
    shift
fi
if [ $# != 1 ] || [ "${1#v}" = "$1" ]; then
    echo "usage: packaging/version.sh [--notes] vX.Y.Z" >&2
    exit 2
fi
version=${1#v}

# The section ends where the next one begins.
section() {
    awk -v version="$version" '
        /^## / { inside = index($0, "## [" version "]") == 1; next }
        inside' CHANGELOG.md
}

text=$(section)
faults=0
if [ -z "$text" ]; then
    echo "CHANGELOG.md has no section '## [$version] …' with something in it" >&2
    faults=1
fi
if [ "$notes" = yes ]; then
    printf '%s\n' "$text"
    exit "$faults"
fi

# names FILE PATTERN: PATTERN has the version as its only group.
names() {
    local found
    found=$(sed -nE "s/$2/\\1/p" "$1" | head -n 1)
    if [ "$found" != "$version" ]; then
        echo "$1 says '$found', the tag says '$version'" >&2
        faults=1
    fi
}

names Cargo.toml '^version = "([^"]*)"$'
names clients/python/pyproject.toml '^version = "([^"]*)"$'
names clients/python/src/softgrasp/__init__.py '^__version__ = "([^"]*)"$'
names CITATION.cff '^version: "?([^"]*)"?$'
# Ours are the packages of the lock file without a source: the version goes on to them by a build.
if ! awk -v version="\"$version\"" '
    function settle() {
        if (name != "" && found != version) { print name, found; wrong = 1 }
        name = ""
    }
    /^\[\[package\]\]/ { settle() }
    /^name = / { name = $3 }
    /^version = / { found = $3 }
    /^source = / { name = "" }
    END { settle(); exit wrong }' Cargo.lock >&2
then
    echo "Cargo.lock has other versions of these crates of ours: cargo update --workspace" >&2
    faults=1
fi
[ "$faults" = 0 ] && echo "every place says $version"
exit "$faults"
