#!/usr/bin/env bash
# The fea-worker of cluster/Dockerfile, without an image: builds PETSc by cluster/petsc.sh and the worker
# against it, looks for code under the GPL in what it is linked with and in what it loads while it runs, and
# asks it on 1 and 2 ranks by every preparation there is. Ends with 0 when all of it holds. Started by a
# person, and not by .ci/run: PETSc takes a quarter of an hour of two cores.
#
#   tests/cluster/without_gpl.sh                       builds everything and runs
#   PETSC=FOLDER tests/cluster/without_gpl.sh          takes what cluster/petsc.sh has put there
#   BIN_DIR=target/debug tests/cluster/without_gpl.sh  takes fea-server and glove-client from there
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh without_gpl
here="$(pwd)/tests/cluster"

take_programs fea-server glove-client
client="$bin_dir/glove-client"
# Of its own: what is built elsewhere may be linked with another PETSc.
target="$(realpath -m "${CARGO_TARGET_DIR:-target}")/without_gpl"
petsc="$(realpath -m "${PETSC:-$target/petsc}")"
if [ -z "${PETSC:-}" ]; then
    if ! { command -v mpicc && command -v gfortran && [ -e /usr/include/dmumps_c.h ]; } >/dev/null; then
        install curl gcc g++ gfortran make pkg-config python3 libopenmpi-dev openmpi-bin \
            libopenblas-dev libscalapack-openmpi-dev libmumps-dev
    fi
    say "building PETSc"
    mkdir -p "$target"
    began=$SECONDS
    cluster/petsc.sh "$petsc" >"$target/petsc.log" 2>&1 ||
        { tail -n 20 "$target/petsc.log" >&2; fail "PETSc is not built"; }
    say "PETSc is built ($((SECONDS - began)) s)"
fi
[ -e "$petsc/lib/pkgconfig/PETSc.pc" ] || fail "there is no PETSc in $petsc"
began=$SECONDS
PKG_CONFIG_PATH="$petsc/lib/pkgconfig" CARGO_TARGET_DIR="$target" \
    cargo build --release --locked --quiet --package fea-worker || fail "fea-worker is not built"
say "fea-worker is built ($((SECONDS - began)) s)"
worker="$target/release/fea-worker"
export LD_LIBRARY_PATH="$petsc/lib"

# shellcheck source=tests/cluster/jobs.sh
source tests/cluster/jobs.sh

cluster/no_gpl.sh "$worker" || fail "the worker is linked with code under the GPL"
ldd "$worker" | grep -q "=> $petsc/lib/libpetsc.so" || fail "the worker is linked with another PETSc"

question strawberry 3000
for element in t4 t4-anp; do
    solve strawberry embedded "front-$element" --method front --element "$element" --poisson 0.45 ||
        fail "front on $element"
done

# asked NAME OPTION...: by each method, of the worker that listens at `address`.
asked() {
    local name=$1 element method
    for element in t4 t4-anp; do
        for method in cluster-cg cluster-factor; do
            solve strawberry "$address" "$name-$method-$element" --method "$method" \
                --element "$element" --poisson 0.45 || fail "$method, $name, $element"
            agrees "front-$element" "$name-$method-$element" 1e-8
            report "$name-$method-$element" method="$method" residual 1e-9 estimated 1e-6 unproven
        done
    done
    # With what MPI, BLAS and PETSc have opened by now.
    cluster/no_gpl.sh --running "$(pgrep -n -f "^$worker --listen")" ||
        fail "code under the GPL is loaded while it runs"
}

for ranks in 1 2; do
    start_worker "ranks-$ranks" "$ranks"
    asked "ranks-$ranks"
    digests "ranks-$ranks" >"$work/matrix-$ranks"
    end "ranks-$ranks"
    say "$ranks ranks: matrices $(paste -sd ' ' "$work/matrix-$ranks"), displacements as on one machine"
done
[ "$(wc -l <"$work/matrix-1")" = 2 ] || fail "two matrices were to be assembled"
cmp -s "$work/matrix-1" "$work/matrix-2" || fail "2 ranks have another matrix"

start_worker repeatable 2 --repeatable
asked repeatable
report repeatable-cluster-cg-t4 because hypre
end repeatable
say "2 ranks, --repeatable: multigrid of hypre"
say "passed ($SECONDS s)"
