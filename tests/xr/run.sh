#!/usr/bin/env bash
# Opens the page of a run in a headless browser: flat, then with a fake headset whose tracked hand lifts
# a strawberry, then again after the connection was lost. Ends with 0 when all of it holds, and with 0
# and one line where there is no browser and none can be installed.
#
#   BIN_DIR=target/debug tests/xr/run.sh [FOLDER]     keeps the pictures of the page in FOLDER
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

say() { printf 'xr: %s\n' "$*"; }
fail() { say "FAILED: $*" >&2; exit 1; }
skip() { say "skipped: $*"; exit 0; }

browser() { command -v chromium || command -v chromium-browser || command -v google-chrome || true; }

command -v python3 >/dev/null || skip "there is no python3"
if [ -z "$(browser)" ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    say "installing chromium"
    {
        timeout 300 apt-get update &&
            DEBIAN_FRONTEND=noninteractive timeout 600 \
                apt-get install -y --no-install-recommends chromium
    } >/dev/null 2>&1 </dev/null || true
fi
[ -n "$(browser)" ] || skip "there is no chromium and it could not be installed (Debian: apt-get install chromium)"

if [ -z "${BIN_DIR:-}" ]; then
    cargo build --workspace --locked --bin glove-client
    BIN_DIR="${CARGO_TARGET_DIR:-target}/debug"
fi
client="$(cd "$BIN_DIR" 2>/dev/null && pwd)/glove-client" || fail "there is no $BIN_DIR"
[ -x "$client" ] || fail "there is no $client; build it first (cargo build --bin glove-client)"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures="${1:-$work}"
mkdir -p "$pictures"
export PYTHONDONTWRITEBYTECODE=1
BROWSER_PROGRAM="$(browser)" python3 tests/xr/look.py "$client" "$work" "$pictures" || fail "see above"
say "passed ($SECONDS s)"
