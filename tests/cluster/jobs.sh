# What the scripts of this folder share: jobs that are started and ended, and questions to them. To be
# sourced behind tests/script.sh, with `worker`, `client` and `here` set, where these are called.

# Few cores: ranks that wait give way, and nothing else takes more than one.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMP_NUM_THREADS=1
mpi=(mpirun --oversubscribe --bind-to none --mca mpi_yield_when_idle 1)
work="$(mktemp -d)"
name="softgrasp-$$"
declare -A pid=()

cleanup() {
    touch "$work/over"
    [ "$1" = 0 ] || show_logs >&2
    for process in "${!pid[@]}"; do
        kill -TERM "${pid[$process]}" || true
    done 2>/dev/null
    wait 2>/dev/null
    for host in a b; do ip netns del "$name-$host" 2>/dev/null || true; done
    rm -rf "$work"
}
ends_by cleanup

# start NAME COMMAND...: in the background; `address` is where it listens.
start() {
    local process=$1
    shift
    : >"$work/$process.out"
    "$@" >"$work/$process.out" 2>>"$work/$process.log" &
    pid[$process]=$!
    wait_until 60 grep -q '^listening on ' "$work/$process.out" || fail "the $process does not start"
    address="$(sed -n 's/^listening on //p' "$work/$process.out" | tail -n 1)"
}

# end NAME: asks a process to end, and waits for it.
end() {
    kill -TERM "${pid[$1]}" 2>/dev/null || true
    wait "${pid[$1]}" 2>/dev/null || true
    unset "pid[$1]"
}

# start_worker NAME RANKS [OPTION...]
start_worker() {
    local process=$1 ranks=$2
    shift 2
    start "$process" "${mpi[@]}" -n "$ranks" "$worker" --listen 127.0.0.1:0 --digest "$@"
}

# -- Questions

# question SHAPE NODES: $work/SHAPE.msh and its known displacements $work/SHAPE.csv.
question() {
    "$client" mesh "$1" --nodes "$2" --out "$work/$1.msh" >/dev/null
    python3 "$here/check.py" known "$work/$1.msh" >"$work/$1.csv"
}

# solve SHAPE ADDRESS OUT [OPTION...]: the answer in $work/OUT.csv, its report in $work/OUT.json.
solve() {
    local shape=$1 at=$2 out=$3
    shift 3
    timeout 240 "$client" solve --mesh "$work/$shape.msh" --known "$work/$shape.csv" --server "$at" \
        --out "$work/$out.csv" --report "$work/$out.json" "$@" >"$work/$out.log" 2>&1
}

# agrees A B AT_MOST: the largest difference over the largest displacement.
agrees() {
    python3 "$here/check.py" agree "$work/$1.csv" "$work/$2.csv" "$3" || fail "$1 and $2 differ"
}

# report OUT CHECK...: what the report of an answer must say.
report() {
    local out=$1
    shift
    python3 "$here/check.py" report "$work/$out.json" "$@" || fail "the report of $out"
}

digests() { sed -n 's/.*matrix \([0-9a-f]\{16\}\)$/\1/p' "$work/$1.log" | sort -u; }
