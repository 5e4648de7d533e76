#!/usr/bin/env bash
# CalculiX as referee: built-in objects and mesh files of others. Ends with 0 when everything agrees, and
# with 0 and one line where ccx is not there and cannot be installed.
#
#   tests/referee/run.sh             small objects and files, three questions of each
#   tests/referee/run.sh full        larger objects, every file and every question, which takes minutes
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh referee

command -v ccx >/dev/null || install calculix-ccx
command -v ccx >/dev/null ||
    skip "ccx is not on the PATH and could not be installed (Debian: apt-get install calculix-ccx)"
# One thread: two tables at once would mix their lines.
SOFTGRASP_REFEREE="${1:-}" cargo test --workspace --locked --test referee -- --nocapture --test-threads 1
say "passed"
