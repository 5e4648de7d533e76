#!/usr/bin/env bash
# CalculiX as referee, in full: every built-in object and mesh file, every question. Ends with 0
# when everything agrees, and with 0 and one line where ccx is not there and cannot be installed.
#
#   tests/referee/run.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

say() { printf 'referee: %s\n' "$*"; }

if ! command -v ccx >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    say "installing calculix-ccx"
    {
        timeout 300 apt-get update &&
            DEBIAN_FRONTEND=noninteractive timeout 600 \
                apt-get install -y --no-install-recommends calculix-ccx
    } >/dev/null 2>&1 </dev/null || true
fi
if ! command -v ccx >/dev/null; then
    say "skipped: ccx is not on the PATH and could not be installed (Debian: apt-get install calculix-ccx)"
    exit 0
fi
# One thread: two tables at once would mix their lines.
SOFTGRASP_REFEREE=full cargo test --workspace --locked --test referee -- --nocapture --test-threads 1
say "passed"
