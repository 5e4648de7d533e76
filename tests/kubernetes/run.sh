#!/usr/bin/env bash
# Checks packaging/kubernetes: the files against the schemas of Kubernetes, and what they say of a
# server against a server. Ends with 0 and one line where Python or the checker cannot be had.
#
#   tests/kubernetes/run.sh                            builds the server and runs
#   BIN_DIR=target/release tests/kubernetes/run.sh     takes a server that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh kubernetes

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if ! python3 -m venv "$work/python" >/dev/null 2>&1 \
    || ! "$work/python/bin/pip" install -q kubernetes-validate >/dev/null 2>&1; then
    skip "python3 with kubernetes-validate (PyPI) cannot be had"
fi
take_programs fea-server
"$work/python/bin/kubernetes-validate" --strict packaging/kubernetes/*.yaml
"$work/python/bin/python" tests/kubernetes/check.py "$bin_dir/fea-server" packaging/kubernetes
say "passed"
