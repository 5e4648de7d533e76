#!/usr/bin/env bash
# Makes everything that a release consists of, into one folder: an archive with the programs, a Debian
# package, two wheels, the list of what is in the programs (CycloneDX), the licences of others, and
# SHA256SUMS. docs/release.md says what is in them and how a release is made.
#
#   packaging/release.sh [OUT_DIR]                        builds in release mode; OUT_DIR is out/release
#   FAST=1 BIN_DIR=target/debug packaging/release.sh …    takes programs that are there, and packs quickly
#
# The same programs, tools and SOURCE_DATE_EPOCH (else the time of the last commit) give the same bytes.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
out="${1:-$here/../out/release}"
mkdir -p "$out" && out="$(cd "$out" && pwd)"
cd "$here/.."
# shellcheck source=tests/script.sh
source tests/script.sh release

python="${PYTHON:-python3}"
# The whole list of what is asked for, before anything is built.
for tool in cargo rustc strip tar gzip "$python"; do
    command -v "$tool" >/dev/null || fail "$tool is needed"
done
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || fail "$python is older than 3.11"
version="$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)"
target="$(rustc -vV | sed -n 's/^host: //p')"
SOURCE_DATE_EPOCH="${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || date +%s)}"
export SOURCE_DATE_EPOCH PYTHONDONTWRITEBYTECODE=1 PIP_DISABLE_PIP_VERSION_CHECK=1
export LC_ALL=C TZ=UTC
umask 022

level=-9 compression=xz
[ -z "${FAST:-}" ] || level=-1 compression=gzip
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
name="softgrasp-$version-$target"
stage="$work/$name"
mkdir -p "$stage/bin"

# -- Programs, man pages, completions

build() {
    if [ -z "${FAST:-}" ]; then
        # Messages of a panic name files: not those of this machine.
        RUSTFLAGS="${RUSTFLAGS:-} --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo"
        RUSTFLAGS="$RUSTFLAGS --remap-path-prefix=$PWD=softgrasp"
        export RUSTFLAGS CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-target}/packaging"
        cargo build --release --locked --package fea-server --package glove-client \
            --features fea-server/otlp,glove-client/otlp --bins --example pages
        BIN_DIR="$CARGO_TARGET_DIR/release"
    fi
    take_programs fea-server glove-client
    for program in fea-server glove-client; do
        strip -o "$stage/bin/$program" "$bin_dir/$program"
        chmod 755 "$stage/bin/$program"
    done
    if [ ! -x "$bin_dir/examples/pages" ]; then
        cargo build --locked --package glove-client --example pages
        bin_dir="${CARGO_TARGET_DIR:-target}/debug"
    fi
    "$bin_dir/examples/pages" "$stage" || fail "man pages and completions"
}

# -- What goes along

documents() {
    cp README.md CHANGELOG.md VERSIONING.md LICENSE-MIT LICENSE-APACHE "$stage/"
    cp -r scenes "$stage/"
    mkdir "$stage/packaging"
    cp -r packaging/fea-server.service packaging/grafana packaging/prometheus packaging/kubernetes \
        packaging/softgrasp.desktop packaging/softgrasp.svg "$stage/packaging/"
    "$python" packaging/third_party.py "$target" "$stage/THIRD-PARTY-LICENSES.md" >"$work/told"
    say "$(sed "s| in /.*||" "$work/told")"
    "$python" packaging/sbom.py "$target" "$stage/$name.cdx.json" >/dev/null
    cp "$stage/THIRD-PARTY-LICENSES.md" "$stage/$name.cdx.json" "$out/"
}

archive() {
    tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" \
        -C "$work" -cf - "$name" | gzip -n "$level" >"$out/$name.tar.gz"
}

# -- The Debian package

# The program of this name; `install` is a word of tests/script.sh.
lay() { command install "$@"; }

# The oldest C library that has all that both programs ask for, as the wheel's name says it.
libc_version() {
    local tag
    tag="$(basename "$out"/softgrasp_bin-*.whl)"
    tag="${tag#*manylinux_}"
    printf '%s\n' "${tag%_"$(uname -m)"*}" | tr _ .
}

debian_package() {
    local root="$work/deb" share
    share="$root/usr/share"
    lay -d "$root/DEBIAN" "$root/etc/default" "$share/applications" "$share/softgrasp"
    lay -d -m 700 "$root/etc/softgrasp"
    lay -D -t "$root/usr/bin" "$stage/bin/fea-server" "$stage/bin/glove-client"
    lay -m 644 packaging/debian/fea-server.default "$root/etc/default/fea-server"
    lay -D -m 644 /dev/stdin "$root/usr/lib/systemd/system/fea-server.service" \
        < <(sed 's|^ExecStart=/usr/local/bin/|ExecStart=/usr/bin/|' packaging/fea-server.service)
    lay -D -m 644 -t "$share/man/man1" "$stage"/man/*.1
    gzip -9n "$share"/man/man1/*.1
    for program in fea-server glove-client; do
        lay -D -m 644 "$stage/completions/$program.bash" "$share/bash-completion/completions/$program"
        lay -D -m 644 -t "$share/zsh/vendor-completions" "$stage/completions/_$program"
        lay -D -m 644 -t "$share/fish/vendor_completions.d" "$stage/completions/$program.fish"
    done
    lay -m 644 -t "$share/applications" packaging/softgrasp.desktop
    lay -D -m 644 -t "$share/icons/hicolor/scalable/apps" packaging/softgrasp.svg
    cp -r "$stage/scenes" "$share/softgrasp/"
    lay -D -m 644 -t "$share/doc/softgrasp" README.md CHANGELOG.md VERSIONING.md
    cp -r packaging/grafana packaging/prometheus "$share/doc/softgrasp/"
    lay -m 644 "$stage/THIRD-PARTY-LICENSES.md" "$share/doc/softgrasp/"
    gzip -9n "$share/doc/softgrasp/THIRD-PARTY-LICENSES.md"
    { echo "Softgrasp: MIT or Apache-2.0, as you like. What it contains of others is in"
      echo "THIRD-PARTY-LICENSES.md.gz beside this file."
      echo
      cat LICENSE-MIT
      echo
      cat LICENSE-APACHE; } >"$share/doc/softgrasp/copyright"
    lay -m 755 -t "$root/DEBIAN" packaging/debian/postinst packaging/debian/prerm packaging/debian/postrm
    echo /etc/default/fea-server >"$root/DEBIAN/conffiles"
    control "$root" >"$root/DEBIAN/control"
    (cd "$root" && find etc usr -type f | sort | xargs md5sum) >"$root/DEBIAN/md5sums"
    dpkg-deb --root-owner-group "-Z$compression" --build "$root" \
        "$out/softgrasp_${version}_$(dpkg --print-architecture).deb" >/dev/null
}

control() {
    cat <<END
Package: softgrasp
Version: $version
Architecture: $(dpkg --print-architecture)
Maintainer: Softgrasp <maintainers@example.invalid>
Installed-Size: $(du -sk --exclude=DEBIAN "$1" | cut -f1)
Depends: libc6 (>= $(libc_version)), libgcc-s1
Recommends: libvulkan1, mesa-vulkan-drivers, libxkbcommon-x11-0, libxcursor1, libxi6, libxrandr2
Section: science
Priority: optional
Description: grasp and squeeze a soft object with a glove, a hand or the mouse
 A glove, a tracked hand or the mouse moves a virtual hand (glove-client); a
 server solves the finite element equations of the object, once per frame
 (fea-server); the object gives way in the fingers, and every answer says how
 wrong it can be. The server is not started when it is installed: it wants a
 token and a certificate in /etc/softgrasp first.
END
}

# -- Wheels

wheels() {
    "$python" -m pip wheel --quiet --no-deps --wheel-dir "$out" ./clients/python ||
        fail "the wheel of clients/python (pip takes hatchling from the index of packages)"
    "$python" packaging/wheel.py "$stage/bin" "$stage" "$version" "$out" >/dev/null
}

# What an older run has left would stand in SHA256SUMS.
rm -f "$out"/softgrasp[-_]* "$out/THIRD-PARTY-LICENSES.md" "$out/SHA256SUMS"
build
documents
archive
wheels
if command -v dpkg-deb >/dev/null; then
    debian_package
else
    say "skipped: the Debian package (no dpkg-deb)"
fi
(cd "$out" && sha256sum -- softgrasp* THIRD-PARTY-LICENSES.md >SHA256SUMS)
say "made in $out:"
(cd "$out" && ls -l | awk 'NR > 1 { printf "  %10d  %s\n", $5, $NF }')
