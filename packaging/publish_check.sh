#!/usr/bin/env bash
# Whether the crates could be published as they are: packs every one of them, as `cargo publish` would, and
# looks into the packages. Nothing is uploaded. Ends with 0 and one line where crates.io cannot be reached.
#
#   packaging/publish_check.sh           packs them (half a minute)
#   FULL=1 packaging/publish_check.sh    builds them too (long: each builds what it needs anew)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=tests/script.sh
source tests/script.sh publish

timeout 60 cargo info --quiet --registry crates-io thiserror >/dev/null 2>&1 ||
    skip "crates.io cannot be reached"

options=(--workspace --dry-run --allow-dirty --locked)
[ -n "${FULL:-}" ] || options+=(--no-verify)
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
touch "$work/begin"
cargo publish "${options[@]}" >"$work/log" 2>&1 || { tail -n 40 "$work/log" >&2; fail "cargo publish"; }

has_file() {
    local kind
    kind="$(tar -tvzf "$1" "$2" 2>/dev/null | cut -c1)"
    [ "$kind" = - ]
}

count=0
for manifest in crates/*/Cargo.toml; do
    name="$(sed -n 's/^name = "\(.*\)"$/\1/p' "$manifest" | head -n 1)"
    version="$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)"
    package="$(find "${CARGO_TARGET_DIR:-target}/package" -name "$name-$version.crate" -newer "$work/begin" |
        head -n 1)"
    [ -n "$package" ] || fail "$name was not packed"
    grep -q "Uploading $name v$version" "$work/log" || fail "$name is not to be published"
    # A link would name a file that a package does not have.
    for file in LICENSE-MIT LICENSE-APACHE README.md src/lib.rs Cargo.toml; do
        has_file "$package" "$name-$version/$file" || fail "$package has no $file"
    done
    # crates.io takes 10 MiB; ours are sources alone, and what is larger came in by mistake.
    size="$(wc -c <"$package")"
    [ "$size" -lt 1048576 ] || fail "$package has $size bytes"
    large="$(tar -tvzf "$package" | awk '$3 > 262144 { print $NF }')"
    [ -z "$large" ] || [ "$large" = "$name-$version/Cargo.lock" ] || fail "$package has the large file $large"
    count=$((count + 1))
done
uploads="$(grep -c ' Uploading ' "$work/log")"
[ "$uploads" = "$count" ] || fail "$uploads packages would be published, and crates has $count"
if grep -q 'example.invalid' Cargo.toml; then
    say "to be filled in before the first release: repository in Cargo.toml"
fi
say "passed: $count packages${FULL:+, each built}"
