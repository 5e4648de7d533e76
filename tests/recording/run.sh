#!/usr/bin/env bash
# Opens a recording with a reader of others (PyPI: mcap), holds every message against its schema, writes it
# again with compressed chunks, and plays those again. Ends with 0 when all of it holds, and with 0 and one
# line where there is no Python 3 or the reader cannot be installed.
#
#   tests/recording/run.sh                            builds the client and runs
#   BIN_DIR=target/release tests/recording/run.sh     takes a client that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh recording

has_python 3.9 || skip "there is no python3 (3.9 or later)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if ! python3 -m venv "$work/venv" >/dev/null 2>&1 ||
    ! "$work/venv/bin/pip" install --quiet --disable-pip-version-check mcap jsonschema 2>/dev/null; then
    skip "mcap and jsonschema cannot be installed from PyPI"
fi
take_programs glove-client
client="$bin_dir/glove-client"
"$client" run --headless --hand scripted:squeeze --object cube --nodes 64 --record "$work/squeeze.mcap" \
    >/dev/null
"$work/venv/bin/python" tests/recording/check.py "$work/squeeze.mcap" "$work"
for compression in zstd lz4; do
    "$client" replay "$work/$compression.mcap" --check | grep -F 'the same bit by bit'
done
say "passed"
