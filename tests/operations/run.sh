#!/usr/bin/env bash
# Two servers behind HAProxy, as docs/operations.md tells to run them for others: the same answers
# through the proxy, a server that is killed, one that is asked to end, one that is full, none at
# all; health and metrics. Ends with 0 when everything holds, and with 0 and one line where a part
# is missing and cannot be installed.
#
#   BIN_DIR=target/release tests/operations/run.sh     takes programs that are built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh operations
here="$(pwd)/tests/operations"

# -- What it needs

missing() {
    command -v haproxy >/dev/null || [ -x /usr/sbin/haproxy ] || { echo haproxy; return; }
    has_python 3.8 || echo python3
}

[ -z "$(missing)" ] || install haproxy python3
[ -z "$(missing)" ] || skip "$(missing) is not there and could not be installed"
PATH="$PATH:/usr/sbin"
take_programs fea-server glove-client
server_program="$bin_dir/fea-server" client_program="$bin_dir/glove-client"

# -- The folder, the processes, and how everything ends

work="$(mktemp -d)"
# By name: a process, the address it listens on, that of its metrics.
declare -A pid=() address=() metrics=()

cleanup() {
    [ "$1" = 0 ] || show_logs >&2
    for name in "${!pid[@]}"; do
        kill -KILL "${pid[$name]}" || true
    done 2>/dev/null
    wait 2>/dev/null
    rm -rf "$work"
}
ends_by cleanup

# The exit code of a process of ours, which must end within so many seconds.
exit_code() {
    local name=$1 seconds=$2 code=0
    wait_until "$seconds" has_ended "${pid[$name]}" || fail "$name did not end in $seconds s"
    wait "${pid[$name]}" 2>/dev/null || code=$?
    unset "pid[$name]"
    return "$code"
}

has_ended() { [[ "$(ps -o stat= -p "$1" 2>/dev/null)" =~ ^(Z|$) ]]; }

# -- Servers, proxy, client

# start_server NAME [OPTION...]: at the addresses it had before, or at free ones.
start_server() {
    local name=$1 out="$work/$1.out"
    shift
    : >"$out"
    "$server_program" --listen "${address[$name]:-127.0.0.1:0}" \
        --metrics "${metrics[$name]:-127.0.0.1:0}" --threads 1 --max-sessions 4 --drain 3 "$@" \
        >"$out" 2>>"$work/$name.log" &
    pid[$name]=$!
    wait_until 20 grep -q '^metrics on ' "$out" || fail "server $name does not start"
    address[$name]="$(sed -n '1s/^listening on //p' "$out")"
    metrics[$name]="$(sed -n '2s/^metrics on //p' "$out")"
    [ -n "${address[$name]}" ] || fail "the first line of server $name is not its address"
}

# end_server NAME SIGNAL: its exit code.
end_server() {
    kill "-$2" "${pid[$1]}"
    exit_code "$1" 20
}

free_port() {
    python3 -c 'import socket; s = socket.create_server(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

start_proxy() {
    address[proxy]="127.0.0.1:$(free_port)"
    SOFTGRASP_PORT="${address[proxy]##*:}" SOFTGRASP_SOCKET="$work/proxy.socket" \
        SOFTGRASP_PLACES=6 \
        SOFTGRASP_A="${address[a]##*:}" SOFTGRASP_A_METRICS="${metrics[a]##*:}" \
        SOFTGRASP_B="${address[b]##*:}" SOFTGRASP_B_METRICS="${metrics[b]##*:}" \
        haproxy -db -f "$here/haproxy.cfg" >"$work/proxy.log" 2>&1 &
    pid[proxy]=$!
    wait_until 10 can_connect "${address[proxy]}" || fail "the proxy does not listen"
}

can_connect() { (exec 3<>"/dev/tcp/${1%:*}/${1##*:}") 2>/dev/null; }

# start_client NAME OPTION...: a run of a small cube, which is recorded. With linear elasticity equal
# questions have equal answers, whatever was asked before.
start_client() {
    local name=$1
    shift
    "$client_program" run --headless --grasp thesis --object cube --nodes 216 --deformation linear \
        --record "$work/$name.mcap" --report "$work/$name.json" "$@" >"$work/$name.log" 2>&1 &
    pid[$name]=$!
}

# client NAME OPTION...: the same to its end, and its exit code.
client() {
    start_client "$@"
    exit_code "$1" 60
}

# start_run NAME HAND TICKS: a run in real time through the proxy. From tick 76 on the object is
# deformed; `squeeze` holds it to the end, `regrasp` keeps the shape and grasps again.
start_run() {
    start_client "$1" --server "${address[proxy]}" --rate 60 --hand "scripted:$2" --frames "$3"
}

# How the proxy sees a server: UP, NOLB (its sessions stay, new ones go elsewhere) or DOWN.
seen_as() {
    python3 - "$work/proxy.socket" "$1" <<'END'
import csv, socket, sys
proxy = socket.socket(socket.AF_UNIX)
proxy.connect(sys.argv[1])
proxy.sendall(b"show stat\n")
for row in csv.DictReader(proxy.makefile()):
    if row["svname"] == sys.argv[2]:
        print(row["status"].split()[0])
END
}

is_seen_as() { [ "$(seen_as "$1")" = "$2" ]; }

await_seen_as() {
    wait_until 5 is_seen_as "$1" "$2" || fail "the proxy sees server $1 as $(seen_as "$1"), not $2"
}

# How many sessions a server has.
sessions() { python3 "$here/metrics.py" "${metrics[$1]}" value softgrasp_sessions; }

# in_grasp NAME: waits until a run deforms its object, and tells which server it asks.
in_grasp() {
    local name holder=""
    python3 "$here/recordings.py" await "$work/$1.mcap" --ticks 20 >&2 || fail "run $1 did not begin"
    for name in a b; do
        [ "$(sessions "$name")" = 0 ] || holder="$name"
    done
    [ -n "$holder" ] || fail "no server has a session"
    python3 "$here/recordings.py" await "$work/$1.mcap" --answers 3 >&2 || fail "run $1: no answer"
    echo "$holder"
}

# end_run NAME HAND QUESTIONS OPTION...: its report must hold what the options say, and its answers
# must be those of the undisturbed run of this hand, to so many questions at least.
end_run() {
    local name=$1 hand=$2 questions=$3 code=0
    shift 3
    exit_code "$name" 40 || code=$?
    [ "$code" = 0 ] || fail "run $name ended with $code"
    told="$(python3 "$here/report.py" "$work/$name.json" "$@")" || fail "run $name"
    compared="$(python3 "$here/recordings.py" compare "$work/direct-$hand.mcap" \
        "$work/$name.mcap" --at-least "$questions")" || fail "run $name"
}

strangers() { python3 "$here/metrics.py" "${metrics[$1]}" value softgrasp_strangers; }
has_strangers() { [ "$(strangers "$1")" = "$2" ]; }

# introduce DESCRIPTOR: sends the example Ping of docs/wire.md, which makes a connection a session.
introduce() {
    printf 'SGRP\4\0\x08\0\0\0\0\0\x10\0\0\0\x08\0\0\0\0\0\0\0\x30\xcc\x82\xc4\xb0\x13\xb8\xdc' >&"$1"
    printf '\x08\0\0\0\0\0\0\0\xef\xcd\xab\x89\x67\x45\x23\x01' >&"$1"
}

status_of() { python3 "$here/metrics.py" "${metrics[$1]}" status "$2"; }
ready_says() { [[ "$(status_of "$1" /ready)" == "$2"* ]]; }

# -- What must hold

same_answers_through_the_proxy() {
    local hand compared
    for hand in regrasp squeeze; do
        client "direct-$hand" --server "${address[a]}" --hand "scripted:$hand" ||
            fail "the run without the proxy"
        client proxied --server "${address[proxy]}" --hand "scripted:$hand" ||
            fail "the run through the proxy"
        compared="$(python3 "$here/recordings.py" compare "$work/direct-$hand.mcap" \
            "$work/proxied.mcap" --every --at-least 60)" || fail "the proxy changes answers"
        say "with and without the proxy ($hand), in every tick: $compared"
    done
}

killed_server_is_replaced_by_the_other() {
    local holder
    start_run killed regrasp 418
    holder="$(in_grasp killed)" || exit 1
    end_server "$holder" KILL || true
    end_run killed regrasp 30 --ticks 418 --lost
    say "server killed in a grasp: $told; $compared"
    start_server "$holder"
    await_seen_as "$holder" UP
}

# Before the first check has failed, the proxy still sends every second connection to the dead one.
connections_to_a_dead_server_go_to_the_other() {
    local n opened=()
    end_server a KILL || true
    for n in 1 2 3 4; do
        exec {opened[$n]}<>"/dev/tcp/${address[proxy]%:*}/${address[proxy]##*:}"
        # Bytes that are no message: a server says so in a message of its own, "SGRP…".
        printf '%064d' 0 >&"${opened[$n]}"
    done
    for n in 1 2 3 4; do
        [ "$(timeout 10 head -c 4 <&"${opened[$n]}")" = SGRP ] || fail "connection $n was lost"
        exec {opened[$n]}>&-
    done
    say "four connections right after a server was killed: all of them answered"
    start_server a
    await_seen_as a UP
}

hung_server_is_replaced_by_the_other() {
    local holder
    start_run hung squeeze 420
    holder="$(in_grasp hung)" || exit 1
    # Its sockets stay and nobody is behind them: to the proxy it is as a host that has vanished.
    kill -STOP "${pid[$holder]}"
    end_run hung squeeze 2 --ticks 420 --lost
    kill -CONT "${pid[$holder]}"
    await_seen_as "$holder" UP
    say "server stopped in the middle of a grasp: $told; $compared"
}

drained_server_keeps_its_session_and_then_hands_it_over() {
    local holder code=0
    start_run drained squeeze 360
    holder="$(in_grasp drained)" || exit 1
    kill -TERM "${pid[$holder]}"
    wait_until 2 ready_says "$holder" '503 stopping' || fail "/ready: $(status_of "$holder" /ready)"
    [[ "$(status_of "$holder" /health)" == "200 "* ]] || fail "/health of a server that drains"
    await_seen_as "$holder" NOLB
    ! can_connect "${address[$holder]}" || fail "a server that drains takes connections"
    [ "$(sessions "$holder")" = 1 ] || fail "the session does not go on while its server drains"
    client beside --server "${address[proxy]}" || fail "a new client while a server drains"
    exit_code "$holder" 10 || code=$?
    [ "$code" = 0 ] || fail "the server that drained ended with $code"
    end_run drained squeeze 20 --ticks 360 --lost
    grep -q '"what": "lost: .*ShuttingDown' "$work/drained.json" || fail "the client was not told why"
    say "server drained in a grasp: exit code 0, a new client served elsewhere; $told; $compared"
    start_server "$holder"
    await_seen_as "$holder" UP
}

full_server_keeps_its_sessions() {
    local holder taken=()
    start_run full squeeze 240
    holder="$(in_grasp full)" || exit 1
    # Connections that say nothing take no place: only those that have introduced themselves do.
    local n
    for n in 1 2 3 4 5 6; do
        exec {taken[$n]}<>"/dev/tcp/${address[$holder]%:*}/${address[$holder]##*:}"
    done
    wait_until 2 has_strangers "$holder" 6 || fail "strangers: $(strangers "$holder"), not 6"
    ready_says "$holder" '200 ready' || fail "/ready: $(status_of "$holder" /ready) beside strangers"
    for n in 1 2 3; do
        introduce "${taken[$n]}"
    done
    wait_until 2 ready_says "$holder" '503 all sessions' || fail "/ready: $(status_of "$holder" /ready)"
    await_seen_as "$holder" NOLB
    client beside --server "${address[proxy]}" || fail "a new client while a server is full"
    for n in 1 2 3 4 5 6; do
        exec {taken[$n]}>&-
    done
    await_seen_as "$holder" UP
    end_run full squeeze 20 --ticks 240 --kept
    say "server full in a grasp: a new client served elsewhere, the session stays; $told; $compared"
}

client_goes_on_without_any_server() {
    start_run alone squeeze 330
    in_grasp alone >/dev/null || exit 1
    end_server a KILL || true
    end_server b KILL || true
    sleep 1
    ! has_ended "${pid[alone]}" || fail "the client ended with its servers"
    start_server b
    end_run alone squeeze 2 --ticks 330 --lost --by server_lost
    say "both servers killed in a grasp, one back after a second: $told; $compared"
    start_server a
    await_seen_as a UP
    await_seen_as b UP
}

state_is_told() {
    local name
    for name in a b; do
        [ "$(status_of "$name" /health)" = "200 alive" ] || fail "/health: $(status_of "$name" /health)"
        [ "$(status_of "$name" /ready)" = "200 ready" ] || fail "/ready: $(status_of "$name" /ready)"
        [[ "$(status_of "$name" /nowhere)" == "404 "* ]] || fail "a page that is not there"
    done
    python3 "$here/metrics.py" "${metrics[a]}" save "$work/before.json" >/dev/null
    # Another material is another model, which this server has not yet.
    client counted --server "${address[a]}" --young 30000 || fail "a run that is counted"
    local grown
    grown="$(python3 "$here/metrics.py" "${metrics[a]}" grown "$work/before.json" \
        sessions received_bytes sent_bytes 'seconds_count kind="Frame"' \
        'seconds_count kind="UploadModel"')" || fail "metrics"
    say "health, readiness and metrics: well formed, $grown"
}

# Two servers with 4 places each, of which the proxy gives one address 6.
one_address_gets_so_many_places() {
    local n places=() more
    for n in 1 2 3 4 5 6; do
        exec {places[$n]}<>"/dev/tcp/${address[proxy]%:*}/${address[proxy]##*:}"
        introduce "${places[$n]}"
    done
    wait_until 5 has_sessions 3 3 || fail "sessions: $(sessions a) and $(sessions b)"
    exec {more}<>"/dev/tcp/${address[proxy]%:*}/${address[proxy]##*:}"
    ! timeout 5 cat <&"$more" 2>/dev/null | grep -q . || fail "one address got seven places of six"
    has_sessions 3 3 || fail "the seventh connection ended another one"
    for n in 1 2 3 4 5 6; do
        exec {places[$n]}>&-
    done
    wait_until 5 has_sessions 0 0 || fail "sessions: $(sessions a) and $(sessions b)"
    say "one address opens seven connections: six sessions, three on each server, one refused"
}

has_sessions() { [ "$(sessions a) $(sessions b)" = "$1 $2" ]; }

token_and_encryption_pass_through_the_proxy() {
    local name code=0
    local access=(--token-file "$work/token")
    head -c 24 /dev/urandom | base64 >"$work/token"
    echo wrong >"$work/wrong"
    "$server_program" --make-certificate 127.0.0.1 --tls-cert "$work/certificate.pem" \
        --tls-key "$work/key.pem" >/dev/null
    for name in a b; do
        end_server "$name" TERM || fail "server $name ended with $?"
        start_server "$name" "${access[@]}" --tls-cert "$work/certificate.pem" \
            --tls-key "$work/key.pem"
        await_seen_as "$name" UP
    done
    client guarded --server "${address[proxy]}" --hand scripted:squeeze "${access[@]}" \
        --tls-ca "$work/certificate.pem" || fail "token and encryption through the proxy"
    compared="$(python3 "$here/recordings.py" compare "$work/direct-squeeze.mcap" \
        "$work/guarded.mcap" --every --at-least 60)" || fail "token and encryption change answers"
    client stranger --server "${address[proxy]}" --token-file "$work/wrong" \
        --tls-ca "$work/certificate.pem" || code=$?
    [ "$code" = 1 ] || fail "a client with a wrong token ended with $code"
    grep -q NotAuthorised "$work/stranger.log" || fail "a client with a wrong token is not told so"
    say "token and TLS through the proxy: $compared; a wrong token is refused"
}

for name in a b; do
    start_server "$name"
done
start_proxy
await_seen_as a UP
await_seen_as b UP
same_answers_through_the_proxy
state_is_told
killed_server_is_replaced_by_the_other
connections_to_a_dead_server_go_to_the_other
hung_server_is_replaced_by_the_other
drained_server_keeps_its_session_and_then_hands_it_over
full_server_keeps_its_sessions
client_goes_on_without_any_server
one_address_gets_so_many_places
token_and_encryption_pass_through_the_proxy
say "passed ($SECONDS s)"
