#!/usr/bin/env bash
# fea-worker under mpirun on 1, 2 and 4 ranks, alone and behind fea-server --cluster: the bits of the
# matrix, the displacements against a factor of one machine, a rank that is killed in the middle, a client
# that goes, the memory limit, two network namespaces as two hosts, and the GPL in what it is linked with.
# Ends with 0 when all of it holds, and with 0 and one line where MPI or PETSc cannot be had.
#
#   tests/cluster/run.sh                            builds the programs and runs
#   BIN_DIR=target/debug tests/cluster/run.sh       takes fea-server and glove-client from there
#
# fea-worker is built in any case: without PETSc it is another program.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh cluster
here="$(pwd)/tests/cluster"

# -- What it needs

missing() {
    command -v mpirun >/dev/null || { echo "mpirun (Open MPI)"; return; }
    pkg-config --atleast-version=3.18 PETSc 2>/dev/null || { echo "PETSc 3.18 (libpetsc-real-dev)"; return; }
    has_python 3.10 || echo "python3 of 3.10"
}

if [ -n "$(missing)" ]; then
    install libpetsc-real-dev libopenmpi-dev openmpi-bin pkg-config python3
    # Where pkg-config itself was missing, nobody has seen that there is something new.
    cargo clean --quiet --package fea-worker
fi
[ -z "$(missing)" ] || skip "$(missing) is not there and could not be installed"
mpirun --version | grep -q 'Open MPI' || skip "mpirun is not that of Open MPI"
take_programs fea-server glove-client
# Of the workspace: by its name alone it would get other features, and with them all it needs anew.
cargo build --locked --quiet --workspace --bin fea-worker || fail "fea-worker is not built"
worker="$(pwd)/${CARGO_TARGET_DIR:-target}/debug/fea-worker"
case "${CARGO_TARGET_DIR:-}" in /*) worker="$CARGO_TARGET_DIR/debug/fea-worker" ;; esac
"$worker" --version >/dev/null || fail "fea-worker does not start"
server_program="$bin_dir/fea-server" client="$bin_dir/glove-client"

# shellcheck source=tests/cluster/jobs.sh
source tests/cluster/jobs.sh

# start_supervised NAME RANKS PORT: starts the job again whenever it ends.
start_supervised() {
    local process=$1
    supervised() {
        local job
        trap 'kill -TERM "$job" 2>/dev/null; wait "$job"; exit 0' TERM
        until [ -e "$work/over" ]; do
            "${mpi[@]}" -n "$1" "$worker" --listen "127.0.0.1:$2" --digest &
            job=$!
            wait "$job" || sleep 0.5
        done
    }
    start "$process" supervised "$2" "$3"
}

# -- Licences: what cluster/no_gpl.sh says of Debian's PETSc

known_by_its_libraries() {
    local library said
    said="$(cluster/no_gpl.sh "$server_program" 2>&1)" || fail "fea-server is refused: $said"
    if ! pkg-config --libs PETSc | grep -q petsc_real; then
        say "the worker's libraries skipped: its PETSc is not Debian's"
        return 0
    fi
    ! said="$(cluster/no_gpl.sh "$worker" 2>&1)" || fail "Debian's PETSc is let through: $said"
    for library in fftw3 umfpack cholmod trilinos; do
        grep -q "lib$library" <<<"$said" || fail "$library is not named: $said"
    done
    say "refused: $said"
}

# -- Ranks: the same matrix to the last bit, and the same displacements

on_ranks() {
    local ranks element
    question strawberry 3000
    for element in t4 t4-anp; do
        solve strawberry embedded "front-$element" --method front --element "$element" --poisson 0.45 ||
            fail "front on $element"
    done
    for ranks in 1 2 4; do
        start_worker "ranks-$ranks" "$ranks"
        for element in t4 t4-anp; do
            for method in cluster-cg cluster-factor; do
                solve strawberry "$address" "$ranks-$method-$element" --method "$method" \
                    --element "$element" --poisson 0.45 || fail "$method on $ranks ranks, $element"
                agrees "front-$element" "$ranks-$method-$element" 1e-8
                report "$ranks-$method-$element" method="$method" residual 1e-9 estimated 1e-6 unproven
            done
        done
        digests "ranks-$ranks" >"$work/matrix-$ranks"
        [ "$(wc -l <"$work/matrix-$ranks")" = 2 ] || fail "two matrices on $ranks ranks"
        cmp -s "$work/matrix-1" "$work/matrix-$ranks" || fail "$ranks ranks have another matrix"
        end "ranks-$ranks"
        say "$ranks ranks: matrices $(paste -sd ' ' "$work/matrix-$ranks"), as on one"
    done
    start_worker repeatable 2 --repeatable
    solve strawberry "$address" hypre --method cluster-cg --poisson 0.45 || fail "hypre"
    agrees front-t4 hypre 1e-8
    report hypre because hypre
    end repeatable
}

refused_for_memory() {
    start_worker little 2 --memory-per-rank 8MiB
    ! solve strawberry "$address" little --method cluster-cg || fail "it takes more than it may"
    grep -q 'MemoryLimit.*2 ranks is predicted to need .* MiB.*memory-per-rank' "$work/little.log" ||
        fail "the refusal has no numbers"
    say "refused: $(grep -o '3000 nodes.*' "$work/little.log" | head -n 1)"
    end little
}

# -- Behind a server

listens() { (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null; }

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

through_a_server() {
    local port began
    port="$(free_port)"
    start_supervised job 2 "$port"
    start head "$server_program" --listen 127.0.0.1:0 --threads 1 --memory-limit 100MiB \
        --cluster "127.0.0.1:$port"
    head_address=$address
    question cube 40000
    solve cube "$head_address" too-large || fail "what is too large is not handed over"
    report too-large method=cluster-cg because 'no method fits'
    solve cube embedded front-cube --method front || fail "front on the cube"
    agrees front-cube too-large 1e-8
    "$client" run --headless --grasp thesis --server "$head_address" --object cube --nodes 216 --frames 240 \
        --report "$work/run.json" >"$work/run.log" 2>&1 || fail "a run through the server"

    # A rank is killed while all of them work: sooner where a quick machine had answered by then.
    local pause
    solve cube embedded front-hard --method front --element t4 --poisson 0.49 || fail "front at 0.49"
    for pause in 1 0.6 0.3 0.15; do
        solve cube "$head_address" killed --method cluster-cg --element t4 --poisson 0.49 &
        sleep "$pause"
        kill -KILL "$(pgrep -n -f "fea-worker --listen 127.0.0.1:$port")"
        wait $! || fail "the question was not answered after the restart"
        agrees front-hard killed 1e-8
        if grep -q 'the cluster was lost' "$work/head.log"; then break; fi
        wait_until 60 listens "$port" || fail "the worker does not come back"
    done
    grep -q 'the cluster was lost' "$work/head.log" || fail "the rank was killed too late each time"
    say "a rank killed in the middle: answered after the restart"

    # A client goes in the middle of a long solve.
    "$client" mesh cube --nodes 100000 --out "$work/cube.msh" >/dev/null
    python3 "$here/check.py" known "$work/cube.msh" >"$work/cube.csv"
    {
        timeout -s KILL 2 "$client" solve --mesh "$work/cube.msh" --known "$work/cube.csv" \
            --server "127.0.0.1:$port" --method cluster-cg --poisson 0.4999 --element t4 \
            --out "$work/gone.csv" || true
    } >/dev/null 2>&1
    began=$SECONDS
    solve strawberry "$head_address" after --method cluster-cg || fail "the worker is not free"
    grep -q 'no answer unsolved=Stopped' "$work/job.log" || fail "it was not stopped"
    say "a client gone in the middle: the ranks were free after $((SECONDS - began)) s"
    end head
    end job
}

guarded() {
    local pair=(--tls-cert "$work/certificate.pem" --tls-key "$work/key.pem")
    (umask 077; head -c 24 /dev/urandom | base64 >"$work/token")
    "$server_program" --make-certificate 127.0.0.1 "${pair[@]}" >/dev/null
    start_worker secret 2 --token-file "$work/token" "${pair[@]}"
    start guarded "$server_program" --listen 127.0.0.1:0 --threads 1 --cluster "$address" \
        --cluster-token-file "$work/token" --cluster-tls-ca "$work/certificate.pem"
    solve strawberry "$address" secret --method cluster-cg --poisson 0.45 || fail "token and TLS"
    agrees front-t4 secret 1e-8
    end guarded
    end secret
}

# -- Two hosts

on_two_hosts() {
    local host
    PATH="$PATH:/usr/sbin"
    [ "$(id -u)" = 0 ] && command -v ip >/dev/null && ip netns add "$name-a" 2>/dev/null ||
        { say "two hosts skipped: network namespaces are not possible here"; return 0; }
    ip netns add "$name-b"
    ip -n "$name-a" link add wire type veth peer name wire netns "$name-b"
    ip -n "$name-a" address add 192.0.2.11/24 dev wire
    ip -n "$name-b" address add 192.0.2.12/24 dev wire
    for host in a b; do
        ip -n "$name-$host" link set lo up
        ip -n "$name-$host" link set wire up
    done
    # What ssh does elsewhere: runs the command on the host of this address.
    cat >"$work/agent" <<AGENT
#!/bin/bash
[ "\$1" = 192.0.2.11 ] && host=a || host=b
shift
exec ip netns exec "$name-\$host" unshare --uts bash -c "hostname \$host; \$*"
AGENT
    chmod +x "$work/agent"
    start hosts ip netns exec "$name-a" unshare --uts bash -c 'hostname a; exec "$@"' - \
        mpirun --mca plm_rsh_agent "$work/agent" --mca plm_rsh_no_tree_spawn 1 \
        -H 192.0.2.11:1,192.0.2.12:1 -n 2 --bind-to none --mca mpi_yield_when_idle 1 \
        --mca btl tcp,self --mca btl_tcp_if_include 192.0.2.0/24 \
        --mca oob_tcp_if_include 192.0.2.0/24 "$worker" --listen 127.0.0.1:7900 --digest
    ip netns exec "$name-a" timeout 240 "$client" solve --mesh "$work/strawberry.msh" \
        --known "$work/strawberry.csv" --server 127.0.0.1:7900 --method cluster-cg --element t4 \
        --poisson 0.45 --out "$work/hosts.csv" >"$work/hosts-solve.log" 2>&1 || fail "two hosts"
    agrees front-t4 hosts 1e-8
    grep -qx "$(digests hosts)" "$work/matrix-1" || fail "two hosts have another matrix"
    say "two hosts: matrix $(digests hosts), as on one"
    end hosts
}

known_by_its_libraries
on_ranks
refused_for_memory
through_a_server
guarded
on_two_hosts
say "passed ($SECONDS s)"
