#!/usr/bin/env bash
# Server and client on two hosts, and bad networks between them. The hosts are network namespaces on
# a bridge in a third one, where a program delays, limits and stalls what passes (link.py; netem of
# the kernel would do it too, but many kernels come without it). Links and hosts fail in the middle
# of a grasp. Prints a table of what a user gets in real time. Ends with 0 when everything holds,
# and with 0 and one line where namespaces are not permitted.
#
#   BIN_DIR=target/release tests/hosts/run.sh [--table FILE] [--object NAME] [--nodes N]
#
# BIN_DIR: programs that are built already. --table writes the table to a
# file too. What is grasped is a cube of 216 nodes unless the options say otherwise.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh hosts
here="$(pwd)/tests/hosts" checks="$(pwd)/tests/operations"

object=cube nodes=216 table=""
while [ $# -gt 0 ]; do
    [ $# -ge 2 ] || fail "$1 wants a value"
    case "$1" in
        --object) object="$2" ;;
        --nodes) nodes="$2" ;;
        --table) table="$2" ;;
        *) fail "$1 is no option" ;;
    esac
    shift 2
done

# -- What it needs

missing() {
    command -v ip >/dev/null || [ -x /usr/sbin/ip ] || { echo "ip (iproute2)"; return; }
    has_python 3.8 || echo python3
}

[ "$(id -u)" = 0 ] || skip "network namespaces want root"
[ -z "$(missing)" ] || install iproute2 python3
[ -z "$(missing)" ] || skip "$(missing) is not there and could not be installed"
PATH="$PATH:/usr/sbin"
take_programs fea-server glove-client
server_program="$bin_dir/fea-server" client_program="$bin_dir/glove-client"

# -- The hosts, the processes, and how everything ends

# Namespaces carry this name, so that runs do not meet and nothing stays behind.
name="softgrasp-$$"
work="$(mktemp -d)"
# By name of a process: its number.
declare -A pid=()
rate=60 count=0
server_host=192.0.2.2 link_host=192.0.2.3
# The namespaces are this run's own, and so are their ports.
server_port=7878 guarded_port=7879 link_port=7880 metrics_address=127.0.0.1:9878

on() {
    local host=$1
    shift
    ip netns exec "$name-$host" "$@"
}

cleanup() {
    [ "$1" = 0 ] || show_logs >&2
    for process in "${!pid[@]}"; do
        kill -KILL "${pid[$process]}" || true
    done 2>/dev/null
    wait 2>/dev/null
    for host in client server net; do
        ip netns del "$name-$host" 2>/dev/null || true
    done
    rm -rf "$work"
}
ends_by cleanup

make_hosts() {
    local host
    ip netns add "$name-net" 2>/dev/null || skip "network namespaces are not permitted here"
    ip -n "$name-net" link add bridge type bridge 2>/dev/null || skip "there are no bridges here"
    ip -n "$name-net" address add "$link_host/24" dev bridge
    ip -n "$name-net" link set bridge up
    for host in client server; do
        ip netns add "$name-$host"
        ip -n "$name-net" link add "to-$host" type veth peer name wire netns "$name-$host"
        ip -n "$name-net" link set "to-$host" master bridge up
        ip -n "$name-$host" link set lo up
        ip -n "$name-$host" link set wire up
    done
    ip -n "$name-client" address add 192.0.2.1/24 dev wire
    ip -n "$name-server" address add "$server_host/24" dev wire
}

has_ended() { [[ "$(ps -o stat= -p "$1" 2>/dev/null)" =~ ^(Z|$) ]]; }

# The exit code of a process of ours, which must end within so many seconds.
exit_code() {
    local process=$1 seconds=$2 code=0
    wait_until "$seconds" has_ended "${pid[$process]}" || fail "$process did not end in $seconds s"
    wait "${pid[$process]}" 2>/dev/null || code=$?
    unset "pid[$process]"
    return "$code"
}

# -- Server, link, client

# start NAME HOST LINE COMMAND...: in the background; waits for a line of its output.
start() {
    local process=$1 host=$2 line=$3
    shift 3
    : >"$work/$process.out"
    ip netns exec "$name-$host" "$@" >"$work/$process.out" 2>>"$work/$process.log" &
    pid[$process]=$!
    wait_until 20 grep -q "$line" "$work/$process.out" || fail "the $process does not start"
}

start_server() {
    start server server '^metrics on ' "$server_program" --insecure \
        --listen "$server_host:$server_port" --metrics "$metrics_address" --threads 1
}

# A server knows nothing when a run begins.
new_server() {
    end server KILL
    start_server
}

# end NAME SIGNAL: ends a process if it is there.
end() {
    [ -n "${pid[$1]:-}" ] || return 0
    { kill "-$2" "${pid[$1]}" && exit_code "$1" 20; } 2>/dev/null || true
}

# start_link OPTION...: in the middle, before the server.
start_link() {
    start link net '^link on ' python3 "$here/link.py" --listen "$link_host:$link_port" \
        --to "$server_host:$server_port" "$@"
}

start_client() {
    ip netns exec "$name-client" "$client_program" run --headless --object "$object" \
        --nodes "$nodes" "$@" >"$work/client.log" 2>&1 &
    pid[client]=$!
}

# start_run ADDRESS HAND TICKS [OPTION...]: in real time.
start_run() {
    local address=$1 hand=$2 ticks=$3
    shift 3
    start_client --server "$address" --rate "$rate" --hand "scripted:$hand" --frames "$ticks" \
        --report "$work/run.json" "$@"
}

# end_run NAME SECONDS CHECK...: the run must end well, and its report hold what the checks say; a
# row of the table.
end_run() {
    local link=$1 seconds=$2 code=0
    shift 2
    exit_code client "$seconds" || code=$?
    [ "$code" = 0 ] || fail "$link: the run ended with $code"
    python3 "$checks/report.py" "$work/run.json" "$@" >"$work/told" || fail "$link"
    python3 "$here/table.py" row "$link" "$work/run.json" "$rate" | tee -a "$work/table.md"
    count=$((count + 1))
}

frames_answered() {
    on server python3 "$checks/metrics.py" "$metrics_address" \
        value softgrasp_request_seconds_count 'Frame"'
}

has_answered() { [ "$(frames_answered)" -ge 20 ]; }

# Waits until the object is deformed and answers come.
in_grasp() { wait_until 30 has_answered || fail "no answers within 30 s"; }

# -- Links

# undisturbed NAME ADDRESS [OPTION...]: a run that grasps, keeps the shape and grasps again.
undisturbed() {
    local link=$1 address=$2
    shift 2
    start_run "$address" regrasp 480 "$@"
    end_run "$link" 30 --ticks 480 --kept
}

# through NAME OPTION...: the same through a link with these options.
through() {
    local link=$1
    shift
    new_server
    start_link "$@"
    undisturbed "$link" "$link_host:$link_port"
    end link KILL
}

guarded() {
    head -c 24 /dev/urandom | base64 >"$work/token"
    local pair=(--tls-cert "$work/certificate.pem" --tls-key "$work/key.pem")
    "$server_program" --make-certificate "$server_host" "${pair[@]}" >/dev/null
    start guarded server '^listening on ' "$server_program" --listen "$server_host:$guarded_port" \
        --threads 1 --token-file "$work/token" "${pair[@]}"
    undisturbed "near, token and TLS" "$server_host:$guarded_port" \
        --token-file "$work/token" --tls-ca "$work/certificate.pem"
    end guarded TERM
}

# -- Failures in the middle of a grasp

# disturbed NAME ADDRESS TICKS WHAT CHECK...: a run that grasps and holds, and what happens then.
disturbed() {
    local link=$1 address=$2 ticks=$3 what=$4
    shift 4
    new_server
    start_run "$address" squeeze "$ticks"
    in_grasp
    "$what"
    end_run "$link" 60 --ticks "$ticks" "$@"
}

pause() { kill -USR1 "${pid[link]}"; }

forget_path() { kill -USR2 "${pid[link]}"; }

pull_cable() {
    ip -n "$name-client" link set wire down
    sleep 3
    ip -n "$name-client" link set wire up
}

# Both hosts keep their cables, and nothing passes between them.
part_for() {
    ip -n "$name-net" link set to-server nomaster
    sleep "$1"
    ip -n "$name-net" link set to-server master bridge
}

part_for_3_s() { part_for 3; }
part_for_8_s() { part_for 8; }

kill_server() {
    end server KILL
    sleep 1
    start_server
}

restart_server() {
    end server TERM
    start_server
}

same_bits_over_the_worst_link() {
    local compared
    new_server
    start_link --delay-ms 20 --jitter-ms 5 --rate-mbit 10 --stall-every 100
    start_client --server "$server_host:$server_port" --record "$work/near.mcap"
    exit_code client 60 || fail "the run in lockstep over the near link"
    start_client --server "$link_host:$link_port" --record "$work/worst.mcap"
    exit_code client 90 || fail "the run in lockstep over the worst link"
    end link KILL
    compared="$(python3 "$checks/recordings.py" compare "$work/near.mcap" "$work/worst.mcap" \
        --every --at-least 100)" || fail "the link changes answers"
    say "in lockstep, near and over the worst link, in every tick: $compared"
}

make_hosts
python3 "$here/table.py" head | tee "$work/table.md"
start_server
undisturbed "near" "$server_host:$server_port"
guarded
through "1 ms each way" --delay-ms 1
through "5 ms each way" --delay-ms 5
through "20 ms each way, jitter 5 ms" --delay-ms 20 --jitter-ms 5
through "10 Mbit/s, 1 ms each way" --delay-ms 1 --rate-mbit 10
through "a packet of 50 comes 200 ms later, 5 ms each way" --delay-ms 5 --stall-every 50
start_link --delay-ms 1 --pause-s 2 --cut-s 3
disturbed "pause of 2 s" "$link_host:$link_port" 480 pause --kept --gap-ms 1900
disturbed "path forgotten, nobody told" "$link_host:$link_port" 1800 forget_path --lost
end link KILL
near="$server_host:$server_port"
disturbed "parted for 3 s" "$near" 600 part_for_3_s --gap-ms 2900
disturbed "parted for 8 s" "$near" 900 part_for_8_s --lost --gap-ms 7900
disturbed "cable pulled for 3 s" "$near" 600 pull_cable --gap-ms 2900
disturbed "server killed, back after 1 s" "$near" 480 kill_server --lost
disturbed "server stopped and started" "$near" 480 restart_server --lost
same_bits_over_the_worst_link
[ -z "$table" ] || cp "$work/table.md" "$table"
say "passed: $count links and failures ($SECONDS s)"
