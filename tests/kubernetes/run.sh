#!/usr/bin/env bash
# Checks packaging/kubernetes: the files against the schemas of Kubernetes, and what they say of a
# server against a server. Ends with 0 and one line where Python or the checker cannot be had.
#
#   tests/kubernetes/run.sh                            builds the server and runs
#   BIN_DIR=target/release tests/kubernetes/run.sh     takes a server that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

say() { printf 'kubernetes: %s\n' "$*"; }

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if ! python3 -m venv "$work/python" >/dev/null 2>&1 \
    || ! "$work/python/bin/pip" install -q kubernetes-validate >/dev/null 2>&1; then
    say "skipped: python3 with kubernetes-validate (PyPI) cannot be had"
    exit 0
fi
if [ -z "${BIN_DIR:-}" ]; then
    cargo build --workspace --locked --bin fea-server
    BIN_DIR="${CARGO_TARGET_DIR:-target}/debug"
fi
"$work/python/bin/kubernetes-validate" --strict packaging/kubernetes/*.yaml
"$work/python/bin/python" tests/kubernetes/check.py "$BIN_DIR/fea-server" packaging/kubernetes
say "passed"
