#!/usr/bin/env bash
# Other systems than Linux on x86_64, from a Debian 13 of its own, whose compiler builds their standard libraries
# from source: whether every published crate compiles for Windows, macOS and ARM, whether the core's tests of its
# vector kernels hold with ARM's vectors (NEON, under qemu), and whether the programs give the same answers on ARM
# (under qemu) and Windows (under Wine) as here. Ends with 0 when all of it holds, and with 0 and one line where a
# part is missing.
#
#   tests/platforms/run.sh                      all of it: a Debian (10 GB with what is built there, thrown away
#                                               afterwards), three checks, three builds and tests: an hour and a half
#   PLATFORMS_ROOT=DIR tests/platforms/run.sh   keeps that Debian and what was built in DIR, or takes what is there
#   ONLY="check" …  ONLY="kernels arm" …        some parts of it: check, kernels, arm and windows
#   BIN_DIR=DIR tests/platforms/run.sh          compares with the glove-client of this system that is there
#
# Of macOS nothing is linked and nothing run: the C parts of dependencies are left out, as their compiler wants
# Apple's headers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh platforms

mirror="${DEBIAN_MIRROR:-http://deb.debian.org/debian}"
only=" ${ONLY:-check kernels arm windows} "
published="core grasp protocol os telemetry hand window xr force emulator"
qemu="qemu-aarch64-static -L /usr/aarch64-linux-gnu"
windows=x86_64-pc-windows-gnu arm=aarch64-unknown-linux-gnu mac=aarch64-apple-darwin

[ "$(id -u)" = 0 ] || skip "a Debian of its own needs root"
[ "$(uname -m)" = x86_64 ] || skip "it is made for x86_64"
command -v unshare >/dev/null || skip "there is no unshare"
command -v python3 >/dev/null || skip "there is no python3"

work="$(mktemp -d)"
cleanup() {
    [ "$1" = 0 ] || show_logs
    # What is mounted in there is so for the commands' own processes only.
    rm -rf "$work"
}
ends_by cleanup
root="${PLATFORMS_ROOT:-$work/trixie}"

# inside COMMAND…: in that Debian, with its own view of processes.
inside() {
    unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" \
        env -i PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin HOME=/root LANG=C.UTF-8 \
        DEBIAN_FRONTEND=noninteractive "$@" </dev/null
}

make_debian() {
    debian_13 "$root" ca-certificates
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    echo "deb $mirror trixie-backports main" >"$root/etc/apt/sources.list.d/backports.list"
    {
        inside apt-get update &&
            inside apt-get install -y --no-install-recommends -t trixie-backports rustc cargo rust-src &&
            inside apt-get install -y --no-install-recommends gcc libc6-dev gcc-mingw-w64-x86-64-posix \
                gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static wine wine64
    } >"$work/packages.log" 2>&1 || fail "its packages"
    # The authorities that this machine trusts, a company's among them.
    cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"
    stand_ins
    touch "$root/made-for-softgrasp"
}

# Where nothing is linked, the C parts of dependencies may be empty.
stand_ins() {
    cat >"$root/usr/local/bin/no-cc" <<'SH'
#!/bin/sh
while [ $# -gt 0 ]; do
    case $1 in
        -o) : >"$2"; shift ;;
        -o?*) : >"${1#-o}" ;;
    esac
    shift
done
SH
    cat >"$root/usr/local/bin/no-ar" <<'SH'
#!/bin/sh
for word in "$@"; do case $word in *.a) : >"$word"; exit 0 ;; esac; done
SH
    chmod 755 "$root/usr/local/bin/no-cc" "$root/usr/local/bin/no-ar"
}

# What is committed, and what is not yet.
copy_source() {
    rm -rf "$root/softgrasp"
    mkdir "$root/softgrasp"
    git ls-files -z --cached --others --exclude-standard |
        tar --create --null --files-from=- --ignore-failed-read 2>/dev/null |
        tar --extract --directory="$root/softgrasp"
}

# other_cargo TARGET COMMAND ARGUMENT…: cargo for another system, whose standard library is compiled too.
other_cargo() {
    local target=$1 command=$2
    shift 2
    # The stable compiler takes `-Z` when it is asked to compile its own library.
    inside env RUSTC_BOOTSTRAP=1 CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0 CARGO_TARGET_DIR=/target \
        CC_aarch64_apple_darwin=no-cc AR_aarch64_apple_darwin=no-ar RANLIB_aarch64_apple_darwin=true \
        SDKROOT=/usr/share \
        CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
        CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="$qemu" \
        CARGO_TARGET_X86_64_PC_WINDOWS_GNU_LINKER=x86_64-w64-mingw32-gcc \
        cargo "$command" --manifest-path /softgrasp/Cargo.toml -Z build-std --target "$target" --locked "$@"
}

# checked TARGET: every published crate compiles, without a warning of its own.
checked() {
    local target=$1 packages="" name
    for name in $published; do packages="$packages --package softgrasp-$name"; done
    # shellcheck disable=SC2086  # a word for each package
    other_cargo "$target" check $packages --package fea-server --package glove-client \
        >"$work/check-$target.log" 2>&1 || fail "the crates do not compile for $target"
    if grep -A1 '^warning' "$work/check-$target.log" | grep -q -- '--> crates/'; then
        grep -A6 '^warning' "$work/check-$target.log" >&2
        fail "warnings for $target"
    fi
    say "all crates compile for $target"
}

# built TARGET: both programs without window and page, which nothing here could show.
built() {
    other_cargo "$1" build --no-default-features --package fea-server --package glove-client --bins \
        >"$work/build-$1.log" 2>&1 || fail "the programs are not built for $1"
}

[ -e "$root/made-for-softgrasp" ] || make_debian
copy_source

case $only in *" check "*)
    checked "$windows"
    checked "$mac"
    checked "$arm"
    ;;
esac

# -- Vector kernels

# Modules of the core that compute by the processor's vectors; each test compares them with plain loops, with
# dense algebra or with closed forms.
kernels="solve::front solve::direct solve::condensed solve::multigrid fem::hyperelastic::groups fem::products
    contact::coulomb"

case $only in *" kernels "*)
    # shellcheck disable=SC2086  # a word for each module
    other_cargo "$arm" test --package softgrasp-core --lib -- $kernels >"$work/kernels.log" 2>&1 ||
        fail "tests of the vector kernels on ARM"
    say "on ARM: $(grep '^test result' "$work/kernels.log")"
    ;;
esac

# -- Answers of programs of other systems

# asked NAME COMMAND…: the same questions to a glove-client, whose answers come to /answers/NAME.
asked() {
    local name=$1 log="$work/ask-$1.log" method
    shift
    rm -rf "${root:?}/answers/$name"
    mkdir -p "$root/answers/$name"
    # ask ARGUMENT…: one question.
    ask() {
        inside env WINEDEBUG=-all "${program[@]}" "$@" >>"$log" 2>&1 || fail "$name: glove-client $*"
    }
    # solve ANSWER ARGUMENT…: one request.
    solve() {
        local answer=$1
        shift
        ask solve --mesh /answers/ball.msh --known /answers/known.csv --young 20000 --poisson 0.4 \
            --out "/answers/$name/solve-$answer.csv" "$@"
    }
    local program=("$@")
    for method in front front-mixed condensed sparse-cholesky pcg multigrid auto; do
        solve "$method" --method "$method"
    done
    solve t10 --element t10 --method front
    solve t4-anp --element t4-anp --method front
    solve large --deformation large
    ask press --mesh /answers/ball.msh --bodies /softgrasp/tests/platforms/bodies.toml \
        --report "/answers/$name/press.json"
    ask run --headless --report "/answers/$name/run.json"
}

# compared NAME: whether its answers are those of this system.
compared() {
    say "answers of $1 beside those of this system"
    python3 tests/platforms/compare.py answers "$root/answers/here" "$root/answers/$1" ||
        fail "answers of $1 differ"
}

case $only in *" arm "* | *" windows "*)
    take_programs glove-client
    mkdir -p "$root/here" "$root/answers"
    cp "$bin_dir/glove-client" "$root/here/"
    "$bin_dir/glove-client" mesh sphere --nodes 1000 --out "$root/answers/ball.msh" >/dev/null
    python3 tests/platforms/compare.py known "$root/answers/ball.msh" "$root/answers/known.csv"
    asked here /here/glove-client
    ;;
esac

case $only in *" arm "*)
    built "$arm"
    # shellcheck disable=SC2086  # the emulator's words
    asked arm $qemu "/target/$arm/debug/glove-client"
    compared arm
    ;;
esac

case $only in *" windows "*)
    built "$windows"
    asked windows wine "/target/$windows/debug/glove-client.exe"
    compared windows
    ;;
esac

say "passed ($SECONDS s)"
