#!/usr/bin/env bash
# A run that never ends beside everything that goes wrong in a day: a server that is killed or asked to end,
# devices whose records are broken or that are unplugged, one-shot requests, windows that are opened and
# closed, and strangers that send nonsense. Memory and latency are sampled every second. Ends with 0 when the
# run has lived through all of it, and with 0 and one line where Python is missing.
#
#   tests/soak/run.sh                                   one minute, as in `.ci/run`
#   tests/soak/run.sh --seconds 1800 --rate 200 --out DIR    longer; writes soak.csv, soak.svg and soak.md
#   BIN_DIR=target/release tests/soak/run.sh            takes programs that are built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh soak
here="$(pwd)/tests/soak"

has_python 3.8 || install python3
has_python 3.8 || skip "python3 is not there and could not be installed"
# A window needs a display and something that draws; without them no window is opened.
command -v Xvfb >/dev/null || install xvfb mesa-vulkan-drivers libvulkan1 libxkbcommon-x11-0
take_programs fea-server glove-client

work="$(mktemp -d)"
display_pid=
cleanup() {
    [ "$1" = 0 ] || show_logs >&2
    [ -z "$display_pid" ] || kill "$display_pid" 2>/dev/null || true
    rm -rf "$work"
}
ends_by cleanup

if command -v Xvfb >/dev/null; then
    Xvfb -displayfd 3 -screen 0 640x480x24 -nolisten tcp 3>"$work/display" >/dev/null 2>&1 &
    display_pid=$!
    wait_until 10 test -s "$work/display" && export SOAK_DISPLAY=":$(cat "$work/display")"
fi
[ -n "${SOAK_DISPLAY:-}" ] || say "Xvfb is not there: no window is opened"
python3 "$here/soak.py" --programs "$bin_dir" --work "$work" "$@"
