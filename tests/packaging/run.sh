#!/usr/bin/env bash
# Makes what a release consists of (packaging/release.sh) from programs that are there, and uses it as a
# stranger would: unpacks the archive, lays out the Debian package and solves over TCP with it, installs both
# wheels and solves from Python, holds checksums, list of contents and licences against what they tell of.
# Ends with 0 when all of it holds, and with 0 and one line where a part is missing.
#
#   BIN_DIR=target/debug tests/packaging/run.sh    takes programs that are built already
#   FULL=1 tests/packaging/run.sh                  also in a fresh Debian (debootstrap): the package, the run that
#                                                  lifts a strawberry, the wheels
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh packaging

python="${PYTHON:-python3}"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ||
    skip "there is no $python of 3.11 or later"
command -v dpkg-deb >/dev/null || skip "there is no dpkg-deb"
command -v readelf >/dev/null || install binutils
command -v readelf >/dev/null || skip "there is no readelf (binutils)"

work="$(mktemp -d)"
pid=
cleanup() {
    [ "$1" = 0 ] || tail -n 20 "$work"/*.log >&2 2>/dev/null || true
    [ -z "$pid" ] || kill -KILL "$pid" 2>/dev/null || true
    wait 2>/dev/null
    rm -rf "$work"
}
ends_by cleanup

"$python" -m venv "$work/venv" 2>/dev/null || skip "$python makes no environments (python3-venv)"
installed="$work/venv/bin/python"
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PYTHONDONTWRITEBYTECODE=1
# Whether the index of packages can be reached; what fails after that is a fault of ours.
timeout 120 "$installed" -m pip install -q --retries 1 --timeout 15 numpy google-crc32c blake3 2>/dev/null ||
    skip "no packages can be installed here (no index of packages, or no way to it)"
take_programs fea-server glove-client

out="$work/out"
FAST=1 BIN_DIR="$bin_dir" packaging/release.sh "$out" >"$work/release.log" 2>&1 || fail "packaging/release.sh"
version="$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)"
target="$(rustc -vV | sed -n 's/^host: //p')"
name="softgrasp-$version-$target"

# -- Checksums, and nothing beside them

(cd "$out" && sha256sum --quiet --check SHA256SUMS) || fail "SHA256SUMS"
[ "$(wc -l <"$out/SHA256SUMS")" = 6 ] || fail "a release has six files: $(cat "$out/SHA256SUMS")"
[ "$(find "$out" -type f | wc -l)" = 7 ] || fail "there are files that SHA256SUMS does not name"

# -- The archive

mkdir "$work/unpacked"
tar -xzf "$out/$name.tar.gz" -C "$work/unpacked"
unpacked="$work/unpacked/$name"
for program in fea-server glove-client; do
    [ "$("$unpacked/bin/$program" --version)" = "$program $version" ] || fail "the version of $program"
    [ -s "$unpacked/man/$program.1" ] || fail "no man page of $program"
    # All commands and options of the program are in its pages.
    sed 's/\\-/-/g' "$unpacked/man/$program.1" >"$work/page"
    "$unpacked/bin/$program" --help | grep -oE -- '--[a-z-]+' | sort -u | while read -r option; do
        grep -qF -- "$option" "$work/page" ||
            fail "$program.1 says nothing of $option"
    done
    bash -n "$unpacked/completions/$program.bash" || fail "the completions of $program"
    needed="$(readelf -d "$unpacked/bin/$program" | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p' |
        grep -vE '^(lib(c|m|gcc_s|pthread|dl|rt)\.so\.[0-9]+|ld-linux.*)$' || true)"
    [ -z "$needed" ] || fail "$program needs $needed, which no package asks for"
done
"$unpacked/bin/glove-client" help | sed -n 's/^  \([a-z]\+\)  .*/\1/p' | grep -v '^help$' |
    while read -r command; do
        [ -s "$unpacked/man/glove-client-$command.1" ] || fail "no man page of glove-client $command"
    done
for file in README.md LICENSE-MIT LICENSE-APACHE THIRD-PARTY-LICENSES.md scenes/peach.toml \
    packaging/fea-server.service "$name.cdx.json"; do
    [ -s "$unpacked/$file" ] || fail "the archive has no $file"
done
"$python" tests/packaging/sbom_check.py "$unpacked/$name.cdx.json" "$unpacked/THIRD-PARTY-LICENSES.md" \
    "$target" || fail "the list of contents"
say "archive: programs, man pages, completions, list of contents"

# -- The Debian package

deb="$(echo "$out"/*.deb)" root="$work/root"
dpkg-deb -x "$deb" "$root"
dpkg-deb -e "$deb" "$root/DEBIAN"
(cd "$root" && md5sum --quiet --check DEBIAN/md5sums) || fail "md5sums of the package"
while read -r file; do
    [ -f "$root$file" ] || fail "conffiles names $file, which is not there"
done <"$root/DEBIAN/conffiles"
for script in postinst prerm postrm; do
    sh -n "$root/DEBIAN/$script" || fail "$script"
done
unit="$root/usr/lib/systemd/system/fea-server.service"
[ -x "$root$(sed -n 's/^ExecStart=\([^ ]*\).*/\1/p' "$unit")" ] || fail "the unit starts what is not there"
[ "$(stat -c %a "$root/etc/softgrasp")" = 700 ] || fail "others can look for the token"
for file in usr/share/{man/man1/fea-server.1.gz,bash-completion/completions/glove-client} \
    usr/share/{applications/softgrasp.desktop,doc/softgrasp/copyright,softgrasp/scenes/peach.toml}; do
    [ -s "$root/$file" ] || fail "the package has no $file"
done
if command -v systemd-analyze >/dev/null; then
    # It looks for the program where the unit says.
    sed "s|=/usr/bin/|=$root/usr/bin/|" "$unit" >"$work/fea-server.service"
    systemd-analyze verify "$work/fea-server.service" >"$work/verify.log" 2>&1 || fail "the unit"
fi

# The main job, with the programs of the package and nothing else.
serve() {
    : >"$work/out.txt"
    env -i PATH=/usr/bin:/bin "$root/usr/bin/fea-server" --listen 127.0.0.1:0 --threads 1 \
        >"$work/out.txt" 2>"$work/server.log" &
    pid=$!
    wait_until 20 grep -q '^listening on ' "$work/out.txt" || fail "the server of the package does not start"
    address="$(sed -n 's/^listening on //p' "$work/out.txt")"
}

client() { env -i PATH=/usr/bin:/bin "$root/usr/bin/glove-client" "$@"; }

serve
client mesh cube --nodes 216 --out "$work/cube.msh" >/dev/null
printf 'node,ux,uy,uz\n0,0,0,0\n5,0,0,0\n30,0,0,0\n210,0,0.001,0\n' >"$work/K.csv"
client solve --server "$address" --mesh "$work/cube.msh" --known "$work/K.csv" --out "$work/U.csv" \
    >"$work/solve.log" 2>&1 || fail "solve over TCP"
[ "$(wc -l <"$work/U.csv")" = 217 ] || fail "the answer has not 216 rows"
awk -F, '$1 == 210 && $3 == 0.001 { found = 1 } END { exit !found }' "$work/U.csv" ||
    fail "node 210 is not where it was put"
kill -TERM "$pid"
wait "$pid" || fail "the server of the package did not end well"
pid=
say "package: $(sed -n '2p' "$work/solve.log")"

# -- Wheels

"$installed" -m pip install -q --no-deps --no-index "$out"/*.whl || fail "the wheels cannot be installed"
"$installed" -m pip check >/dev/null || fail "the wheels need what is not there"
cat >"$work/example.py" <<'END'
import sys

import softgrasp

mesh = softgrasp.Mesh.block((0.04, 0.04, 0.02), (4, 4, 2))
model = softgrasp.Model(mesh, softgrasp.Material(young=20e3, poisson=0.4))
case = softgrasp.LoadCase().prescribe(mesh.nodes_at(z=0.0), (0, 0, 0))
case = case.prescribe(mesh.nodes_at(z=0.02), (0, 0, -0.001))
with softgrasp.Server.spawn() as server:
    answer = server.solve(model, case)
force = answer.reactions.total(mesh.nodes_at(z=0.02))[2]
assert force < -0.5 and answer.residual_rel < 1e-9, (force, answer.residual_rel)
print(f"packaging: {sys.argv[1]}: pressed by {force:.2f} N, residual {answer.residual_rel:.0e}")
END
env -i "$installed" "$work/example.py" wheels || fail "the example in Python"

# -- The list of contents by the schema of CycloneDX

"$python" -m venv "$work/schema" && "$work/schema/bin/python" -m pip install -q \
    'cyclonedx-python-lib[json-validation]>=8' 2>/dev/null &&
    "$work/schema/bin/python" - "$out/$name.cdx.json" <<'END' || fail "the list is no CycloneDX 1.5"
import sys

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

with open(sys.argv[1]) as file:
    fault = JsonStrictValidator(SchemaVersion.V1_5).validate_str(file.read())
if fault:
    sys.exit(str(fault))
END

# -- A fresh Debian

if [ -n "${FULL:-}" ]; then
    [ "$(id -u)" = 0 ] || fail "FULL=1 wants root"
    command -v debootstrap >/dev/null || install debootstrap
    command -v debootstrap >/dev/null || fail "FULL=1 wants debootstrap"
    fresh="$work/fresh"
    debootstrap --variant=minbase "${SUITE:-bookworm}" "$fresh" >"$work/debootstrap.log" 2>&1 ||
        fail "debootstrap"
    cp "$deb" "$fresh/softgrasp.deb"
    chroot "$fresh" apt-get install -y --no-install-recommends /softgrasp.deb >"$work/apt.log" 2>&1 ||
        fail "apt-get install"
    cp "$work/cube.msh" "$work/K.csv" "$fresh/tmp/"
    chroot "$fresh" glove-client solve --mesh /tmp/cube.msh --known /tmp/K.csv --out /tmp/U.csv >/dev/null ||
        fail "solve in a fresh Debian"
    cmp "$fresh/tmp/U.csv" "$work/U.csv" || fail "a fresh Debian gives other bits"
    # What a person with nothing runs first, then the wheels with Debian's own Python.
    chroot "$fresh" glove-client run --headless --report /tmp/run.json >"$work/run.log" 2>&1 ||
        fail "the run in a fresh Debian"
    python3 - "$fresh/tmp/run.json" <<'END' || fail "nothing is lifted in a fresh Debian"
import json
import sys

with open(sys.argv[1]) as file:
    contacts = [frame["contact"] for frame in json.load(file)["frames"] if frame["contact"]]
carried = [c for c in contacts if c["table_force_n"] == 0 and sum(c["finger_force_n"]) > 0]
sys.exit(len(carried) < 100)
END
    chroot "$fresh" apt-get install -y --no-install-recommends python3-numpy python3-pip >>"$work/apt.log" 2>&1 ||
        fail "Python in a fresh Debian"
    # What the wheels need beyond Debian's packages comes from where this machine's pip gets it.
    version="$(chroot "$fresh" python3 -c 'import sys; print(f"{sys.version_info[0]}.{sys.version_info[1]}")')"
    "$installed" -m pip download -q --only-binary=:all: --python-version "$version" --dest "$fresh/tmp" \
        blake3 google-crc32c >"$work/pip.log" 2>&1 || fail "what the wheels need, for Python $version"
    cp "$out"/*.whl "$work/example.py" "$fresh/tmp/"
    chroot "$fresh" sh -c 'pip install -q --no-index --break-system-packages /tmp/*.whl' \
        >"$work/pip.log" 2>&1 || fail "the wheels in a fresh Debian"
    chroot "$fresh" python3 /tmp/example.py "a fresh Debian" || fail "the example in a fresh Debian"
    chroot "$fresh" apt-get purge -y softgrasp >>"$work/apt.log" 2>&1 || fail "apt-get purge"
    [ ! -e "$fresh/usr/bin/fea-server" ] || fail "purge leaves the programs"
    say "a fresh Debian: installed, solved the same, a strawberry lifted, Python, purged"
fi
say "passed ($SECONDS s)"
