#!/usr/bin/env bash
# Checks packaging/grafana and packaging/prometheus: the alerts by promtool, with an example of each; what
# a running server tells by promtool too; that dashboard, alerts and docs/operations.md name the metrics
# that it has, and all of them; and what client, servers and cluster send to a collector of OpenTelemetry.
# Ends with 0 and one line where promtool cannot be had.
#
#   tests/monitoring/run.sh                            builds the server and runs
#   BIN_DIR=target/release tests/monitoring/run.sh     takes a server that is built already
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=tests/script.sh
source tests/script.sh monitoring

missing() {
    command -v promtool >/dev/null || { echo "promtool (Debian's prometheus)"; return; }
    has_python 3.9 || { echo "python3 (3.9 or later)"; return; }
    command -v curl >/dev/null || echo curl
}

[ -z "$(missing)" ] || install prometheus python3 curl
[ -z "$(missing)" ] || skip "$(missing) is not there and could not be installed"
take_programs fea-server glove-client
server="$bin_dir/fea-server"

work="$(mktemp -d)"
pid=
cleanup() {
    [ "$1" = 0 ] || tail -n 6 "$work/log" >&2 2>/dev/null || true
    [ -z "$pid" ] || kill -KILL "$pid" 2>/dev/null || true
    wait 2>/dev/null
    rm -rf "$work"
}
ends_by cleanup

promtool check config packaging/prometheus/prometheus.yml >"$work/told" 2>&1 ||
    fail "prometheus.yml: $(cat "$work/told")"
promtool check rules packaging/prometheus/alerts.yml >"$work/told" 2>&1 ||
    fail "alerts.yml: $(cat "$work/told")"
# Every alert has an example in which it comes.
grep -oE 'alert: \w+' packaging/prometheus/alerts.yml | sed 's/alert: //' | while read -r alert; do
    grep -qE "labels:.*alertname=\"$alert\"" packaging/prometheus/alerts_test.yml ||
        fail "alerts_test.yml has no example of $alert"
done
promtool test rules packaging/prometheus/alerts_test.yml >"$work/told" 2>&1 ||
    fail "the alerts: $(cat "$work/told")"
say "alerts: well formed, and each comes when it should"

# With named tokens and a certificate, so that it has every metric.
(umask 077 && for name in lab ward; do
    printf 'name=%s token=%s\n' "$name" "$(head -c 24 /dev/urandom | base64)"
done >"$work/tokens")
"$server" --make-certificate localhost --tls-cert "$work/certificate.pem" --tls-key "$work/key.pem" \
    >/dev/null 2>&1
"$server" --listen 127.0.0.1:0 --metrics 127.0.0.1:0 --threads 1 --token-file "$work/tokens" \
    --tls-cert "$work/certificate.pem" --tls-key "$work/key.pem" >"$work/out" 2>"$work/log" &
pid=$!
wait_until 20 grep -q '^metrics on ' "$work/out" || fail "the server does not start"
address="$(sed -n 's/^metrics on //p' "$work/out")"
curl --silent --show-error --fail --max-time 10 --noproxy '*' "http://$address/metrics" \
    >"$work/metrics" || fail "the server shows no metrics"
promtool check metrics <"$work/metrics" >"$work/told" 2>&1 || fail "metrics: $(cat "$work/told")"
python3 tests/monitoring/check.py "$work/metrics" packaging/grafana/softgrasp.json \
    packaging/prometheus/alerts.yml docs/operations.md || fail "names"

# With the schema of OpenTelemetry itself, where an index of packages can be reached.
python=python3
if python3 -m venv "$work/venv" >/dev/null 2>&1 && timeout 120 "$work/venv/bin/python" -m pip install \
    -q --retries 1 --timeout 15 opentelemetry-proto >/dev/null 2>&1; then
    python="$work/venv/bin/python"
    timeout 120 "$python" -m pip install -q ./clients/python >/dev/null 2>&1 ||
        say "skipped: a trace from Python (the package cannot be installed)"
fi
"$python" tests/monitoring/traces.py "$server" "$bin_dir/glove-client" docs/operations.md || fail "traces"
say "passed"
