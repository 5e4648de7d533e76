# What the scripts of tests share: their words, packages of Debian, and the programs that they run.
# To be sourced with bash, in the root of the repository, under `set -euo pipefail`, with the name that
# the script says its lines under: `source tests/script.sh xr`.

script_name=$1

say() { printf '%s: %s\n' "$script_name" "$*"; }
fail() { say "FAILED: $*" >&2; exit 1; }
skip() { say "skipped: $*"; exit 0; }

# has_python MAJOR.MINOR: whether there is a python3 of this version or a later one.
has_python() {
    python3 -c "import sys; sys.exit(sys.version_info < (${1/./, }))" 2>/dev/null
}

# install PACKAGE…: from Debian's packages, where that is permitted. Who calls looks afterwards.
install() {
    [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null || return 0
    say "installing $*"
    {
        timeout 300 apt-get update &&
            DEBIAN_FRONTEND=noninteractive timeout 600 \
                apt-get install -y --no-install-recommends "$@"
    } >/dev/null 2>&1 </dev/null || true
}

# debian_13 FOLDER PACKAGE,…: a Debian 13 of the script's own; `mirror` is where from, `work` has the log.
debian_13() {
    command -v debootstrap >/dev/null || install debootstrap
    command -v debootstrap >/dev/null || skip "there is no debootstrap and it could not be installed"
    python3 - "$mirror/dists/trixie/InRelease" <<'PY' 2>/dev/null || skip "$mirror cannot be reached"
import sys, urllib.request
urllib.request.urlopen(sys.argv[1], timeout=20).read(64)
PY
    say "making a Debian 13 in $1"
    mkdir -p "$1"
    debootstrap --variant=minbase --include="$2" trixie "$1" "$mirror" >"$work/debootstrap.log" 2>&1 ||
        fail "debootstrap"
}

# take_programs PROGRAM…: those in BIN_DIR, or else built now; `bin_dir` is where they are.
take_programs() {
    local program
    if [ -z "${BIN_DIR:-}" ]; then
        # shellcheck disable=SC2046  # an option and a word for each program
        cargo build --workspace --locked $(printf -- '--bin %s ' "$@")
        BIN_DIR="${CARGO_TARGET_DIR:-target}/debug"
    fi
    bin_dir="$(cd "$BIN_DIR" 2>/dev/null && pwd)" || fail "there is no $BIN_DIR"
    for program in "$@"; do
        [ -x "$bin_dir/$program" ] ||
            fail "there is no $bin_dir/$program; build it first (cargo build --bin $program)"
    done
}

# wait_until SECONDS COMMAND…: until the command succeeds, at most so long.
wait_until() {
    local deadline=$((SECONDS + $1))
    shift
    until "$@"; do
        [ "$SECONDS" -lt "$deadline" ] || return 1
        sleep 0.05
    done
}

# show_logs: the ends of all logs in the script's own folder, which it names `work`.
show_logs() {
    local file
    for file in "$work"/*.log; do
        [ -e "$file" ] || continue
        say "the end of ${file##*/}:"
        tail -n 8 "$file"
    done
}

# ends_by FUNCTION: calls it once when the script ends, however that comes about, with the exit status,
# which stays as it is.
ends_by() {
    # shellcheck disable=SC2064  # the name of the function is known now
    trap "status=\$?; trap - EXIT INT TERM; $1 \"\$status\"; exit \"\$status\"" EXIT
    trap 'exit 130' INT
    trap 'exit 143' TERM
}
