"""Starts a server with the very options of the Deployment and asks it for what the files count on."""

import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

import yaml

program, folder = sys.argv[1], Path(sys.argv[2])


def read(name):
    with (folder / name).open() as file:
        return yaml.safe_load(file)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def page(port, path):
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=5) as reply:
            return reply.status, reply.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def given(arguments, name):
    [value] = [a.split("=", 1)[1] for a in arguments if a.startswith(f"--{name}=")]
    return value


deployment, service = read("deployment.yaml"), read("service.yaml")
autoscaler, budget = read("autoscaler.yaml"), read("disruption-budget.yaml")
pod = deployment["spec"]["template"]
[container] = pod["spec"]["containers"]
arguments = container["args"]

# The files name each other rightly.
labels = pod["metadata"]["labels"].items()
for selector in (
    deployment["spec"]["selector"]["matchLabels"],
    service["spec"]["selector"],
    budget["spec"]["selector"]["matchLabels"],
):
    assert selector.items() <= labels, selector
assert autoscaler["spec"]["scaleTargetRef"]["name"] == deployment["metadata"]["name"]
ports = {port["name"]: port["containerPort"] for port in container["ports"]}
assert given(arguments, "listen").endswith(f":{ports['wire']}")
assert given(arguments, "metrics").endswith(f":{ports['pages']}")
assert pod["metadata"]["annotations"]["prometheus.io/port"] == str(ports["pages"])
assert [port["targetPort"] for port in service["spec"]["ports"]] == ["wire"]
mount = container["volumeMounts"][0]["mountPath"]
for option in ("token-file", "tls-cert", "tls-key"):
    assert given(arguments, option).startswith(f"{mount}/"), option

# It is killed only after it has ended by itself, and there is memory for what is not counted.
drain = int(given(arguments, "drain"))
assert pod["spec"]["terminationGracePeriodSeconds"] >= drain + 5
limit = int(re.fullmatch(r"(\d+)GiB", given(arguments, "memory-limit"))[1])
allowed = int(re.fullmatch(r"(\d+)Gi", container["resources"]["limits"]["memory"])[1])
assert allowed >= limit + 1, (allowed, limit)
[metric] = autoscaler["spec"]["metrics"]
wanted = int(metric["pods"]["target"]["averageValue"])
assert 0 < wanted < int(given(arguments, "max-sessions")), "there is room while another one starts"

with tempfile.TemporaryDirectory() as place:
    wire, pages = free_port(), free_port()
    here = {
        "listen": f"127.0.0.1:{wire}",
        "metrics": f"127.0.0.1:{pages}",
        "token-file": f"{place}/token",
        "tls-cert": f"{place}/certificate.pem",
        "tls-key": f"{place}/key.pem",
        # The pod's time to drain is not waited for here.
        "drain": "0",
    }
    Path(place, "token").write_text("0123456789abcdef0123456789abcdef\n")
    Path(place, "token").chmod(0o600)
    subprocess.run(
        [program, "--make-certificate", "localhost", "--tls-cert", here["tls-cert"]]
        + ["--tls-key", here["tls-key"]],
        check=True,
        capture_output=True,
    )
    command = [program]
    for argument in arguments:
        name, value = argument.removeprefix("--").split("=", 1)
        command.append(f"--{name}={here.get(name, value)}")
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert server.stdout.readline().startswith("listening on "), "it takes all options"
        for probe in ("readinessProbe", "livenessProbe"):
            asked = container[probe]["httpGet"]
            assert asked["port"] == "pages"
            status, text = page(pages, asked["path"])
            assert status == 200, (probe, status, text)
        _, text = page(pages, "/metrics")
        name = metric["pods"]["metric"]["name"]
        assert re.search(rf"^{name} \d", text, re.MULTILINE), f"no metric {name}"
        server.send_signal(signal.SIGTERM)
        start = time.monotonic()
        assert server.wait(timeout=10) == 0
        assert time.monotonic() - start < 5
    finally:
        server.kill()
