#!/usr/bin/env bash
# Installs the Python package into an environment of its own, and runs its tests and every example
# against a server. Ends with 0 when all of it holds, and with 0 and one line where Python or what
# it installs from is not there.
#
#   tests/python/run.sh                            builds the server and runs
#   BIN_DIR=target/release tests/python/run.sh     takes a server that is built already
#   PYTHON=python3.12 tests/python/run.sh          takes another Python
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh python

python="${PYTHON:-python3}"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null ||
    skip "there is no $python of 3.10 or later"

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$python" -m venv "$work/venv" 2>/dev/null || skip "$python makes no environments (python3-venv)"
installed="$work/venv/bin/python"
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1
# Whether the index of packages can be reached; what fails after that is a fault of the package.
timeout 120 "$installed" -m pip install -q --retries 1 --timeout 15 hatchling 2>/dev/null ||
    skip "no packages can be installed here (no index of packages, or no way to it)"

take_programs fea-server

"$installed" -m pip install -q './clients/python[test]' || fail "the package cannot be installed"
"$installed" -m pip install -q pyigtl 2>/dev/null || say "skipped: the bridge to OpenIGTLink (no pyigtl)"
export SOFTGRASP_SERVER="$bin_dir/fea-server" PATH="$bin_dir:$PATH"
# Nothing is written into the tree.
export PYTHONDONTWRITEBYTECODE=1 MPLCONFIGDIR="$work" XDG_CACHE_HOME="$work"
say "$("$installed" --version), numpy $("$installed" -c 'import numpy; print(numpy.__version__)')"

"$installed" -m mypy --config-file clients/python/pyproject.toml --cache-dir "$work/mypy" \
    -p softgrasp || fail "the types"
"$installed" -m pytest -q -p no:cacheprovider clients/python/tests || fail "the tests"

mesh=fuzz/seeds/mesh/cube-msh
declare -A arguments=(
    [squeeze]="$mesh --out $work/squeezed.png"
    [sweep]="--out $work/stiffness.csv"
    [grasps]="--out $work/grasps.jsonl"
)
for example in clients/python/examples/*.py; do
    name="$(basename "$example" .py)"
    say "example $name"
    # shellcheck disable=SC2086  # several arguments
    timeout 120 "$installed" "$example" ${arguments[$name]:-} || fail "the example $name"
done
say "example sweep, by Dask"
"$installed" clients/python/examples/sweep.py --dask >/dev/null || fail "the sweep by Dask"
for notebook in clients/python/examples/*.ipynb; do
    say "notebook $(basename "$notebook")"
    # Its cells as one program: no notebook server is needed for that.
    "$installed" -c 'import json, sys; print("\n".join("".join(cell["source"]) + "\n"
        for cell in json.load(open(sys.argv[1]))["cells"] if cell["cell_type"] == "code"))' \
        "$notebook" >"$work/notebook.py"
    MPLBACKEND=Agg timeout 120 "$installed" "$work/notebook.py" || fail "the notebook $notebook"
done
[ -s "$work/squeezed.png" ] || fail "no plot was written"
[ "$(wc -l <"$work/stiffness.csv")" = 16 ] || fail "the sweep has not 15 rows"
timeout 120 "$installed" clients/python/benchmarks/frame_rate.py --cells 6 --frames 50 ||
    fail "the benchmark"
say "passed"
