#!/usr/bin/env bash
# Opens the page of a run in a headless browser: flat, then with a fake headset whose tracked hand lifts a
# strawberry, then again after the connection was lost, then with both hands, which lift a cube. Ends with 0
# when all of it holds, and with 0 and one line where there is no browser and none can be installed.
#
#   BIN_DIR=target/debug tests/xr/run.sh [FOLDER]     keeps the pictures of the page in FOLDER
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh xr

browser() { command -v chromium || command -v chromium-browser || command -v google-chrome || true; }

command -v python3 >/dev/null || skip "there is no python3"
[ -n "$(browser)" ] || install chromium
[ -n "$(browser)" ] || skip "there is no chromium and it could not be installed (Debian: apt-get install chromium)"

take_programs glove-client

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures="${1:-$work}"
mkdir -p "$pictures"
export PYTHONDONTWRITEBYTECODE=1
BROWSER_PROGRAM="$(browser)" python3 tests/xr/look.py "$bin_dir/glove-client" "$work" "$pictures" || fail "see above"
say "passed ($SECONDS s)"
