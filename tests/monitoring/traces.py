"""Plays requests with a collector of its own and looks at the spans and metrics that come.

    python3 tests/monitoring/traces.py FEA_SERVER GLOVE_CLIENT OPERATIONS.md

A client asks a server, which hands a mesh that does not fit into its memory to a second server, in the place
of a cluster; then a hand lifts an object; then, where the package is there, a Python program asks. Every attribute of a span and every metric must be in the page. The
collector reads JSON, and protobuf where the package opentelemetry-proto is there.
"""

import base64
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

# Nodes of the mesh that is too large for so much memory.
NODES, MEMORY = "20000", "100MiB"
SOON_S = 60
# The forms of a kind.
SERVER, CLIENT = 2, 3
# Trace and span that the Python program tells, and the forms in which the collector has the span: as
# hexadecimal text in JSON, as base64 of its bytes where the protobuf package makes JSON of it.
TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
IDENTITIES = {SPAN, base64.b64encode(bytes.fromhex(SPAN)).decode()}
# Attributes that the page has no line for: they are the specification's.
OF_SPECIFICATION = {"rpc.system", "rpc.method"}


class Collector:
    """Keeps what is posted: lists of spans (with their service) and of metrics."""

    def __init__(self):
        self.spans, self.metrics, self.kinds = [], [], set()
        collector = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                collector.take(self.path, self.headers["Content-Type"], body)
                reply = b"{}" if "json" in self.headers["Content-Type"] else b""
                self.send_response(200)
                self.send_header("Content-Type", self.headers["Content-Type"])
                self.send_header("Content-Length", str(len(reply)))
                self.end_headers()
                self.wfile.write(reply)

            def log_message(self, *_):
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = "http://127.0.0.1:%d" % self.server.server_address[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def take(self, path, kind, body):
        self.kinds.add(kind.split(";")[0])
        posted = json.loads(body) if "json" in kind else protobuf(path, body)
        if path == "/v1/traces":
            for of_service in posted["resourceSpans"]:
                service = attributes(of_service["resource"])["service.name"]
                for scope in of_service["scopeSpans"]:
                    self.spans += [dict(span, service=service) for span in scope["spans"]]
        elif path == "/v1/metrics":
            for of_service in posted["resourceMetrics"]:
                for scope in of_service["scopeMetrics"]:
                    self.metrics += scope["metrics"]
        else:
            raise ValueError(path)


def protobuf(path, body):
    """A message of OTLP as the objects that JSON has."""
    from google.protobuf.json_format import MessageToDict
    from opentelemetry.proto.collector.metrics.v1 import metrics_service_pb2
    from opentelemetry.proto.collector.trace.v1 import trace_service_pb2

    if path == "/v1/traces":
        message = trace_service_pb2.ExportTraceServiceRequest()
    else:
        message = metrics_service_pb2.ExportMetricsServiceRequest()
    message.ParseFromString(body)
    return MessageToDict(message, use_integers_for_enums=True)


def attributes(of):
    pairs = of.get("attributes", [])
    return {pair["key"]: next(iter(pair["value"].values()), None) for pair in pairs}


class Program:
    """A server, ended with the block."""

    def __init__(self, command, environment, log):
        self.log = open(log, "w")
        self.process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=self.log, text=True
        )
        line = self.process.stdout.readline()
        assert line.startswith("listening on "), f"{line!r}: {Path(log).read_text()}"
        self.address = line.split()[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(20)
        self.process.stdout.close()
        self.log.close()


def play(server, client, folder, collector, protocol):
    """Asks for one solve and plays a run; all programs have ended and sent what they had."""

    def environment(service):
        return dict(
            os.environ,
            OTEL_EXPORTER_OTLP_ENDPOINT=collector.address,
            OTEL_EXPORTER_OTLP_PROTOCOL=protocol,
            OTEL_SERVICE_NAME=service,
            OTEL_BSP_MAX_QUEUE_SIZE="100000",
            # What a server keeps is read while it runs.
            OTEL_METRIC_EXPORT_INTERVAL="500",
            NO_PROXY="127.0.0.1",
        )

    def run(*arguments):
        command = [client, *arguments]
        done = subprocess.run(
            command, env=environment("client"), capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, f"{command}: {done.stderr}"
        return done.stderr

    listen = [server, "--listen", "127.0.0.1:0", "--threads", "1"]
    mesh, known = folder / "large.msh", folder / "known.csv"
    if not mesh.exists():
        run("mesh", "cube", "--nodes", NODES, "--out", str(mesh))
    write_known(mesh, known)
    with (
        Program(listen, environment("cluster"), folder / "cluster.log") as cluster,
        Program(
            [*listen, "--memory-limit", MEMORY, "--cluster", cluster.address],
            environment("server"),
            folder / "server.log",
        ) as head,
    ):
        where = ["--server", head.address]
        solve = ["solve", "--mesh", str(mesh), "--known", str(known)]
        told = run(*solve, *where, "--out", str(folder / "solved.csv"))
        run("run", "--headless", "--ticks", "300", *where)
        is_asked = ask_from_python(head.address)
    return told, is_asked


def ask_from_python(address):
    """Asks a server as part of a trace; whether the package is there."""
    try:
        import softgrasp
    except ImportError:
        return False
    mesh = softgrasp.Mesh.block((0.04, 0.02, 0.02), (4, 2, 2))
    model = softgrasp.Model(mesh, softgrasp.Material(20_000.0, 0.3))
    case = softgrasp.LoadCase().prescribe(mesh.nodes_at(x=0.0), (0, 0, 0))
    case = case.prescribe(mesh.nodes_at(x=0.04), (0.001, 0, 0))
    with softgrasp.Server(address) as server, softgrasp.traced(f"00-{TRACE}-{SPAN}-01"):
        server.keep(model).frame(case)
    return True


def check_python(collector):
    """The server's spans of these requests stand below the span that the program told."""
    ours = [span for span in collector.spans if span.get("parentSpanId") in IDENTITIES]
    assert {span["name"] for span in ours} == {"UploadModel", "Frame"}, ours
    traces = {span["traceId"] for span in ours}
    assert len(traces) == 1, traces


def write_known(mesh, known):
    """Holds the nodes at one end of a mesh in MSH 4.1 and pushes those at the other."""
    lines = iter(Path(mesh).read_text().splitlines())
    assert "$Nodes" in lines
    blocks = int(next(lines).split()[0])
    heights = []
    for _ in range(blocks):
        count = int(next(lines).split()[3])
        for _ in range(count):
            next(lines)
        heights += [float(next(lines).split()[2]) for _ in range(count)]
    low, high = min(heights), max(heights)
    rows = ["node,ux,uy,uz"]
    rows += [f"{node},0,0,0" for node, height in enumerate(heights) if height == low]
    push = -0.01 * (high - low)
    rows += [f"{node},0,0,{push}" for node, height in enumerate(heights) if height == high]
    Path(known).write_text("\n".join(rows) + "\n")


def check(collector):
    """Every span of a server stands below that of its client; the solve went through all three."""
    spans = collector.spans
    by_id = {span["spanId"]: span for span in spans}
    below = {}
    for span in spans:
        if (parent := span.get("parentSpanId")) and parent not in IDENTITIES:
            assert parent in by_id, f"{span['service']} {span['name']}: its parent is not there"
            assert by_id[parent]["traceId"] == span["traceId"]
            below.setdefault(parent, []).append(span)
    chains = 0
    for span in spans:
        if (span["service"], span["name"]) != ("client", "Ask"):
            continue
        assert attributes(span)["server.address"], span
        (server,) = below[span["spanId"]]
        (question,) = below[server["spanId"]]
        (worker,) = below[question["spanId"]]
        chain = [server, question, worker]
        assert [link["service"] for link in chain] == ["server", "server", "cluster"], chain
        assert [link["kind"] for link in chain] == [SERVER, CLIENT, SERVER], chain
        told = attributes(worker)
        assert told["softgrasp.method"], told
        times = [int(link["startTimeUnixNano"]) for link in [span, *chain]]
        assert times == sorted(times), times
        assert float(told["softgrasp.factor_ms"]) + float(told["softgrasp.solve_ms"]) > 0, told
        chains += 1
    assert chains == 1, f"{chains} requests went to the cluster"
    steps = [span for span in spans if (span["service"], span["name"]) == ("server", "ContactFrame")]
    carried = [span for span in steps if int(attributes(span)["softgrasp.contact.points"]) > 0]
    assert len(steps) > 100 and carried, f"{len(steps)} steps, {len(carried)} with contact"
    assert all(span.get("parentSpanId") for span in steps)
    uploads = [span for span in spans if span["name"] == "UploadModel" and span["kind"] == SERVER]
    assert uploads and all("softgrasp.model" in attributes(span) for span in uploads)
    return len(spans), chains, len(steps)


def check_names(collector, page):
    """What comes is in the page."""
    text = Path(page).read_text()
    text = text[text.index("## Traces") :]
    names = {name for span in collector.spans for name in attributes(span)} - OF_SPECIFICATION
    for name in sorted(names):
        last = re.escape(name.rsplit(".", 1)[-1])
        assert re.search(rf"`(\S*\.)?{last}`", text), f"{page} does not tell of {name}"
    metrics = {metric["name"] for metric in collector.metrics}
    for name in sorted(metrics):
        short = name.removeprefix("softgrasp.server")
        assert f"`{name}`" in text or f"`{short}`" in text, f"{page} does not tell of {name}"
    assert len(names) > 15 and len(metrics) > 5, (names, metrics)
    seconds = [metric for metric in collector.metrics if metric["name"].endswith(".duration")]
    points = [point for metric in seconds for point in metric["histogram"]["dataPoints"]]
    methods = {attributes(point)["rpc.method"] for point in points}
    assert {"Ask", "ContactFrame", "UploadModel", "Hello"} <= methods, methods


def main():
    server, client, page = sys.argv[1:]
    try:
        import opentelemetry.proto.trace.v1.trace_pb2  # noqa: F401

        protocols = ["http/json", "http/protobuf"]
    except ImportError:
        protocols = ["http/json"]
        print("monitoring: without the package opentelemetry-proto JSON alone is read")
    with tempfile.TemporaryDirectory() as name:
        for protocol in protocols:
            collector = Collector()
            told, is_asked = play(server, client, Path(name), collector, protocol)
            if "without the feature otlp" in told:
                print("monitoring: traces skipped: the programs were built without the feature otlp")
                return
            began = time.monotonic()
            while not collector.metrics and time.monotonic() < began + SOON_S:
                time.sleep(0.1)
            counts = "%d spans, %d request through all three, %d steps of contact" % check(collector)
            check_names(collector, page)
            if is_asked:
                check_python(collector)
                counts += ", and those of Python"
            assert len(collector.kinds) == 1, collector.kinds
            print(f"monitoring: traces by {protocol}: {counts}")


if __name__ == "__main__":
    main()
