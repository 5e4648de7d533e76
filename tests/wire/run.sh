#!/usr/bin/env bash
# Runs the Python code of docs/wire.md against a server. Ends with 0 when all of it holds, and with
# 0 and one line where there is no Python 3.
#
#   tests/wire/run.sh                            builds the server and runs
#   BIN_DIR=target/release tests/wire/run.sh     takes a server that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh wire

has_python 3.8 || skip "there is no python3 (3.8 or later)"
take_programs fea-server
python3 -I -S tests/wire/run.py "$bin_dir/fea-server" docs/wire.md
say "passed"
