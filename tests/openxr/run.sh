#!/usr/bin/env bash
# Hands from an OpenXR runtime without a headset: Monado with its remote driver, in a Debian 13 of its own,
# whose hands a small program moves. Looks at what is said where there is no loader and no runtime, at hands
# that close on an object, at hands out of sight, and at a runtime that is killed in the middle and comes
# back. Ends with 0 when all of it holds, and with 0 and one line where a part is missing.
#
#   tests/openxr/run.sh                         builds the client with its feature openxr, and a Debian 13
#                                               (two minutes, 1 GB, thrown away afterwards)
#   OPENXR_ROOT=DIR tests/openxr/run.sh         keeps that Debian in DIR, or takes what is there
#   BIN_DIR=DIR tests/openxr/run.sh             takes a client that is built with the feature already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh openxr

mirror="${DEBIAN_MIRROR:-http://deb.debian.org/debian}"
packages=monado-service,libopenxr1-monado,libopenxr-loader1,mesa-vulkan-drivers
# The port of Monado's remote driver, which cannot be told another one.
port=4242

[ "$(id -u)" = 0 ] || skip "a Debian of its own needs root"
command -v python3 >/dev/null || skip "there is no python3"
if (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; then skip "port $port is taken"; fi

work="$(mktemp -d)"
service="" sender="" run=""
cleanup() {
    local process
    for process in $service $sender $run; do kill "$process" 2>/dev/null || true; done
    wait 2>/dev/null || true
    [ "$1" = 0 ] || show_logs
    # Nothing is mounted in there.
    if [ -n "${room:-}" ]; then rm -rf "$room"; fi
    rm -rf "$work"
}
ends_by cleanup

root="${OPENXR_ROOT:-$work/trixie}"
if [ ! -e "$root/usr/bin/monado-service" ]; then
    debian_13 "$root" "$packages"
fi

if [ -z "${BIN_DIR:-}" ]; then
    cargo build --workspace --locked --features glove-client/openxr --bin glove-client
    BIN_DIR="${CARGO_TARGET_DIR:-target}/debug"
fi
take_programs glove-client
room="$(mktemp -d "$root/tmp/softgrasp.XXXXXX")"
chmod 700 "$room"
here="/tmp/${room##*/}"
cp "$bin_dir/glove-client" "$room/glove-client"

# inside COMMAND…: takes the place of the shell, in that Debian.
inside() {
    exec chroot "$root" env -i PATH=/usr/bin:/bin HOME="$here" XDG_RUNTIME_DIR="$here" \
        XRT_COMPOSITOR_NULL=1 P_OVERRIDE_ACTIVE_CONFIG=remote XRT_NO_STDIN=1 "$@"
}

start_service() {
    # A killed one leaves these behind.
    rm -f "$room/monado_comp_ipc" "$room/monado.pid"
    inside monado-service >>"$work/service.log" 2>&1 </dev/null &
    service=$!
    wait_until 30 test -S "$room/monado_comp_ipc" || fail "Monado does not start"
}

# move_hands OPTION…: from the beginning, when they are open.
move_hands() {
    if [ -n "$sender" ]; then
        kill "$sender"
        wait "$sender" 2>/dev/null || true
    fi
    python3 tests/openxr/send_hands.py 600 "$@" &
    sender=$!
    # The runtime keeps the hands of the sender before until then.
    sleep 0.5
}

object=(--object sphere --object-size 0.05 --nodes 300 --place hand)

# grasp LOG TICKS ARGUMENT…: a run that follows hands of the runtime.
grasp() {
    local log=$1 ticks=$2
    shift 2
    (inside "$here/glove-client" run --headless "${object[@]}" --ticks "$ticks" \
        --report "$here/report.json" "$@") >"$work/$log.log" 2>&1 </dev/null
}

# refused LOG WORDS ARGUMENT…: a run that cannot begin, and says why.
refused() {
    local log=$1 words=$2 code=0
    shift 2
    (inside "$@" "$here/glove-client" run --headless "${object[@]}" --ticks 1 --hand openxr) \
        >"$work/$log.log" 2>&1 </dev/null || code=$?
    grep -qF 'feature `openxr`' "$work/$log.log" &&
        fail "$bin_dir/glove-client was built without its feature openxr"
    [ "$code" = 1 ] || fail "a run with $log ended with $code"
    grep -qF "$words" "$work/$log.log" || fail "a run with $log does not say: $words"
}

# -- What is said where there is nothing

refused no-runtime "no OpenXR runtime answers, ERROR_RUNTIME_UNAVAILABLE (-51)" \
    env XR_RUNTIME_JSON=/nowhere.json
refused no-service "no OpenXR runtime answers"
if ! ldconfig -p | grep -q libopenxr_loader; then
    code=0
    "$bin_dir/glove-client" run --headless "${object[@]}" --ticks 1 --hand openxr \
        >"$work/no-loader.log" 2>&1 </dev/null || code=$?
    [ "$code" = 1 ] || fail "a run without a loader ended with $code"
    grep -qF "there is no OpenXR loader" "$work/no-loader.log" || fail "it does not name the loader"
fi
say "machines without a loader, a runtime, or one that runs are told so"

# -- Hands that close on an object

start_service
move_hands
grasp both 600 --hand openxr --record "$here/both.mcap" || fail "a run with both hands"
python3 tests/openxr/check.py "$room/report.json" openxr 1000
(inside "$here/glove-client" replay "$here/both.mcap" --check) >"$work/replay.log" 2>&1 </dev/null ||
    fail "its replay"
grep -qF 'the same bit by bit' "$work/replay.log" || fail "its replay differs"
move_hands
grasp right 400 --hand openxr:right || fail "a run with the right hand"
python3 tests/openxr/check.py "$room/report.json" openxr:right 300

# -- Hands that are out of sight

move_hands --hidden
if grasp hidden 200 --hand openxr; then fail "a run without any hand ended with 0"; fi
grep -q "there was never a hand: .*sees no hand" "$work/hidden.log" || fail "it does not say that no hand is seen"

# -- A runtime that is killed while they grasp

move_hands
: >"$work/killed.log"
grasp killed 900 --hand openxr &
run=$!
wait_until 60 grep -q "fitted to" "$work/killed.log" || fail "no hand has come"
kill -KILL "$service"
wait "$service" 2>/dev/null || true
wait_until 20 grep -q "it is looked for every second" "$work/killed.log" || fail "the loss is not told"
wait_until 20 grep -q "is silent" "$work/killed.log" || fail "the hand is not held"
start_service
wait_until 20 grep -q "speaks again" "$work/killed.log" || fail "the hand does not come back"
wait "$run" || fail "the run whose runtime was killed"
run=""
python3 tests/openxr/check.py "$room/report.json" openxr 1000
say "passed ($SECONDS s)"
