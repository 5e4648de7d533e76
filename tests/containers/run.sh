#!/usr/bin/env bash
# Server and client as two containers on a network of their own, through the Dockerfile and
# docker-compose.yml of the repository, with stand-ins for the two base images: no registry is
# needed. Ends with 0 when everything holds, and with 0 and one line where no engine runs.
#
#   tests/containers/run.sh              builds the programs (release) and runs
#   BIN_DIR=target/debug tests/containers/run.sh     takes programs that are built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh containers

command -v docker >/dev/null || skip "there is no docker command"
timeout 20 docker info >/dev/null 2>&1 || skip "no docker engine answers"
if docker compose version >/dev/null 2>&1; then
    compose=(docker compose)
elif command -v docker-compose >/dev/null; then
    compose=(docker-compose)
else
    skip "there is neither docker compose nor docker-compose"
fi

# Everything made here carries this name, so that runs do not meet and nothing stays behind.
name="softgrasp-test-$$"
export COMPOSE_PROJECT_NAME="$name"
export SOFTGRASP_BASE_BUILD="$name-base-build" SOFTGRASP_BASE_RUN="$name-base-run"
export SOFTGRASP_SERVER_IMAGE="$name-server" SOFTGRASP_CLIENT_IMAGE="$name-client"
stage_image="$name-stage"
work="$(mktemp -d)"

cleanup() {
    {
        timeout 60 "${compose[@]}" down --volumes --remove-orphans --timeout 2
        docker rmi --force "$SOFTGRASP_SERVER_IMAGE" "$SOFTGRASP_CLIENT_IMAGE" "$stage_image" \
            "$SOFTGRASP_BASE_BUILD" "$SOFTGRASP_BASE_RUN"
    } >"$work/cleanup.log" 2>&1 || true
    rm -rf "$work"
}
ends_by cleanup

# Runs a command quietly with a time limit; shows its output only when it fails.
quietly() {
    local seconds=$1 code=0
    shift
    timeout "$seconds" "$@" >"$work/log" 2>&1 || code=$?
    if [ "$code" -ne 0 ]; then
        cat "$work/log" >&2
        fail "'$*' ended with $code (124 means: not within $seconds s)"
    fi
}

# Copies programs with the shared libraries they load into a directory that becomes an image.
copy_with_libraries() {
    local root=$1 program
    shift
    for program in "$@"; do
        cp -L --parents "$program" "$root"
        # Static programs and scripts make ldd fail: they load nothing.
        { ldd "$program" 2>/dev/null || true; } | grep -oE '/[^ )]+' | sort -u |
            xargs -r cp -L --parents -t "$root"
    done
}

import_image() {
    tar -C "$1" -c . | docker import --change 'ENV PATH=/usr/local/bin:/usr/bin:/bin' - "$2" \
        >/dev/null
}

build_images() {
    local base_build="$work/build" base_run="$work/run"
    mkdir -p "$base_build"/{prebuilt,tmp,usr/local/bin} "$base_run"/{tmp,proc,usr/local/bin}
    copy_with_libraries "$base_build" /bin/sh "$(command -v cp)" "$(command -v mkdir)"
    cp "$bin_dir/fea-server" "$bin_dir/glove-client" "$base_build/prebuilt/"
    cp tests/containers/standin-cargo.sh "$base_build/usr/local/bin/cargo"
    chmod 755 "$base_build/usr/local/bin/cargo"
    copy_with_libraries "$base_run" /bin/sh "$(command -v chown)" "$(command -v grep)"
    # The programs' libraries belong to the base; the programs come from the build stage.
    mkdir "$work/programs"
    copy_with_libraries "$work/programs" "$bin_dir/fea-server" "$bin_dir/glove-client"
    rm -rf "${work:?}/programs$bin_dir"
    cp -a "$work/programs/." "$base_run"
    import_image "$base_build" "$SOFTGRASP_BASE_BUILD"
    import_image "$base_run" "$SOFTGRASP_BASE_RUN"
    if ! docker buildx version >/dev/null 2>&1; then
        # The classic builder leaves the build stage behind as a nameless image; named, it goes
        # with the rest.
        DOCKER_BUILDKIT=0 quietly 120 docker build --target build --tag "$stage_image" \
            --build-arg "BASE_BUILD=$SOFTGRASP_BASE_BUILD" \
            --build-arg "BASE_RUN=$SOFTGRASP_BASE_RUN" .
    fi
    quietly 120 "${compose[@]}" build
}

# With -a: newer versions list running containers only.
container_of() { "${compose[@]}" ps -aq "$1"; }

server_has_sessions() {
    [ "$(docker logs "$(container_of server)" 2>&1 | grep -c 'session begins')" -ge "$1" ]
}

# Exit code of the client's container, which must end within so many seconds.
client_exit_code() {
    timeout "$1" docker wait "$(container_of client)" || fail "the client did not end in $1 s"
}

server_is_healthy() {
    [ "$(docker inspect --format '{{.State.Health.Status}}' "$(container_of server)")" = healthy ]
}

start_server() {
    quietly 60 "${compose[@]}" up -d --force-recreate server
    wait_until 60 server_is_healthy || fail "the server is not healthy within 60 s"
}

# One-off client beside the running server; the arguments are those of glove-client.
client() {
    quietly 120 "${compose[@]}" run --rm --no-deps -T client "$@"
}

known_corners() {
    # Four corners of a cube of n³ nodes: three held, one moved by a millimetre.
    local n=$1
    printf 'node,ux,uy,uz\n0,0,0,0\n%d,0,0,0\n%d,0,0,0\n%d,0,0.001,0\n' \
        $((n - 1)) $((n * (n - 1))) $((n * n * (n - 1)))
}

put_into_volume() {
    docker run --rm -i --user 65532:65532 --volume "${name}_out:/out" --entrypoint /bin/sh \
        "$SOFTGRASP_BASE_RUN" -c 'while IFS= read -r line; do echo "$line"; done > "$0"' "$1"
}

take_from_volume() {
    local holder
    holder="$(docker create --volume "${name}_out:/out" "$SOFTGRASP_CLIENT_IMAGE")"
    docker cp "$holder:/out/$1" "$2" >/dev/null
    docker rm "$holder" >/dev/null
}

same_bits_in_containers_as_on_the_host() {
    start_server
    client mesh cube --nodes 216 --out /out/cube.msh
    known_corners 6 | put_into_volume /out/known.csv
    client solve --mesh /out/cube.msh --known /out/known.csv --server server:7878 \
        --out /out/moved.csv --report /out/solve.json
    take_from_volume cube.msh "$work/cube.msh"
    take_from_volume moved.csv "$work/moved.csv"
    known_corners 6 >"$work/known.csv"
    "$bin_dir/glove-client" solve --mesh "$work/cube.msh" --known "$work/known.csv" \
        --out "$work/here.csv" >/dev/null
    cmp "$work/moved.csv" "$work/here.csv" || fail "the containers' answer has other bits"
    say "one request between two containers: same bits as on the host"
}

lost_server_ends_solve_with_one_line() {
    client mesh cube --nodes 1000 --out /out/large.msh
    known_corners 10 | put_into_volume /out/known-large.csv
    start_server
    SOFTGRASP_CLIENT_COMMAND="solve --mesh /out/large.msh --known /out/known-large.csv \
        --method gauss-jordan-plain --server server:7878 --out /out/never.csv" \
        quietly 60 "${compose[@]}" up -d client
    wait_until 30 server_has_sessions 1 || fail "no session within 30 s"
    docker kill "$(container_of server)" >/dev/null
    local code
    code="$(client_exit_code 30)"
    local said
    said="$(docker logs "$(container_of client)" 2>&1)"
    [ "$code" = 1 ] || fail "after losing the server solve ended with $code, not 1: $said"
    grep -q '^glove-client: ' <<<"$said" || fail "no reason given: $said"
    say "server killed during a request: exit code 1, '$said'"
}

# The report of a run, which must have ended with 0 (or a code of `$2`) and played every tick.
take_report() {
    local code
    code="$(client_exit_code 120)"
    [[ "$code" =~ ^(${2:-0})$ ]] || fail "run ended with $code: $(docker logs "$(container_of client)" 2>&1)"
    take_from_volume r.json "$work/r.json"
    grep -qE '"ticks": '"$1"',' "$work/r.json" || fail "the report does not count $1 ticks"
}

reported() { grep -qE "$1" "$work/r.json"; }

# The last run entered these states of a grasp, had frames solved, and never lost the server.
undisturbed_run_entered() {
    local state
    for state in "$@"; do
        reported "\"entered $state\"" || fail "the run never entered $state"
    done
    reported '"solves": [1-9]' || fail "no frame was solved"
    if reported '"what": "(lost|refused):'; then
        fail "the server was lost or refused in an undisturbed run"
    fi
}

whole_run_through_the_compose_file() {
    # Nothing but the file's own commands: a grasp by contact, which deforms from the first touch on.
    quietly 120 "${compose[@]}" up -d --force-recreate
    take_report 600
    reported '"contact": "friction"' || fail "the run did not grasp by contact"
    undisturbed_run_entered Free Deforming
    say "run: 600 ticks by contact, frames solved by the other container"
}

whole_run_by_the_rules_of_the_thesis() {
    SOFTGRASP_CLIENT_COMMAND="run --headless --server server:7878 --frames 600 \
        --grasp thesis --report /out/r.json" quietly 120 "${compose[@]}" up -d --force-recreate
    take_report 600
    undisturbed_run_entered Free Avoiding Attached Deforming Detached
    say "run: 600 ticks by the thesis's rules, every grasp state, frames solved by the other container"
}

# Starts a run in real time and waits until its link to the server stands: the first session only
# asks whether somebody is there.
start_run_in_real_time() {
    quietly 60 "${compose[@]}" rm --force --stop client
    start_server
    SOFTGRASP_CLIENT_COMMAND="run --headless --server server:7878 --rate 60 --frames $1 \
        --hand scripted:${2:-regrasp} --report /out/r.json" quietly 60 "${compose[@]}" up -d client
    wait_until 30 server_has_sessions 2 || fail "no link to the server within 30 s"
}

lost_server_never_stops_a_tick() {
    start_run_in_real_time 300
    docker kill "$(container_of server)" >/dev/null
    # 1 where the server was gone before the fingers asked for the first time.
    take_report 300 '0|1'
    reported '"what": "lost: ' || fail "the report does not say that the server was lost"
    reported '"entered Deforming"' ||
        fail "the grasp did not go on: $(grep -oE '"(what|ticks_skipped)": .*' "$work/r.json" | tr '\n' ' ')"
    say "server killed during a run: all 300 ticks played, the loss reported"
}

restarted_server_is_found_again() {
    start_run_in_real_time 400
    local server
    server="$(container_of server)"
    docker kill "$server" >/dev/null
    docker start "$server" >/dev/null
    take_report 400
    reported '"what": "lost: ' || fail "the report does not say that the server was lost"
    reported '"solves": [1-9]' || fail "no frame was solved after the server came back"
    say "server killed and started again: found again, frames solved"
}

# Takes a container (of the server or of the client) off the network in the middle of a grasp, and puts it back.
parted_container_is_found_again() {
    local container network="${name}_grasp" missed
    # The object is deformed to the end.
    start_run_in_real_time 720 squeeze
    container="$(container_of "$1")"
    sleep 2
    docker network disconnect "$network" "$container"
    sleep 3
    # With the name by which the other one knows it.
    docker network connect --alias "$1" "$network" "$container"
    take_report 720
    missed="$(grep -oE '"(answer_late|server_lost)": [0-9]+' "$work/r.json" |
        { total=0; while read -r _ count; do total=$((total + count)); done; echo "$total"; })"
    [ "$missed" -ge 120 ] || fail "the $1 was parted for 3 s, and only $missed ticks have no answer"
    grep '"solve":' "$work/r.json" | tail -n 10 | grep -q '{' ||
        fail "nothing was answered at the end, 6 s after the $1 came back"
    say "$1 off the network for 3 s: all 720 ticks played, $missed without an answer, then answers again"
}

if [ -n "${BIN_DIR:-}" ]; then
    bin_dir="$(cd "$BIN_DIR" && pwd)"
else
    say "building the programs"
    cargo build --release --locked --bins --package fea-server --package glove-client --no-default-features \
        --features fea-server/otlp,glove-client/otlp
    bin_dir="$(cd "${CARGO_TARGET_DIR:-target}/release" && pwd)"
fi
say "building images on stand-in bases"
build_images
same_bits_in_containers_as_on_the_host
lost_server_ends_solve_with_one_line
whole_run_through_the_compose_file
whole_run_by_the_rules_of_the_thesis
lost_server_never_stops_a_tick
restarted_server_is_found_again
parted_container_is_found_again server
parted_container_is_found_again client
say "passed"
