#!/usr/bin/env bash
# Runs the Python code of docs/wire.md against a server. Ends with 0 when all of it holds, and with
# 0 and one line where there is no Python 3.
#
#   tests/wire/run.sh                            builds the server and runs
#   BIN_DIR=target/release tests/wire/run.sh     takes a server that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

say() { printf 'wire: %s\n' "$*"; }

if ! python3 -c 'import sys; sys.exit(sys.version_info < (3, 8))' 2>/dev/null; then
    say "skipped: there is no python3 (3.8 or later)"
    exit 0
fi
if [ -z "${BIN_DIR:-}" ]; then
    cargo build --workspace --locked --bin fea-server
    BIN_DIR="${CARGO_TARGET_DIR:-target}/debug"
fi
python3 -I -S tests/wire/run.py "$BIN_DIR/fea-server" docs/wire.md
say "passed"
