"""Plays a long run beside faults, and looks whether it lives through them, as `run.sh` tells."""

import argparse
import os
import platform
import random
import signal
import socket
import statistics
import subprocess
import sys
import time
import urllib.request

from draw import picture

# A run must have frames again so soon after a server or the devices are back, s.
RECOVERY_S = 30.0
# Resident memory may grow so much from the second quarter of the soak to the last.
GROWTH_SHARE, GROWTH_MIB = 0.05, 8.0
DEVICE_FAULTS = [
    "dead-sensor", "zero-byte", "not-plugged-in", "hemisphere-flip", "station-error", "error-record",
    "truncated", "noise", "duplicate", "burst", "silence",
]


class Failed(Exception):
    """What does not hold, in words."""


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def resident_mib(process):
    """Resident memory of a process, MiB; None where it has ended."""
    try:
        with open(f"/proc/{process.pid}/status") as status:
            for line in status:
                if line.startswith("VmRSS:"):
                    return int(line.split()[1]) / 1024.0
    except OSError:
        pass
    return None


class Soak:
    """All processes, and what was sampled of them."""

    def __init__(self, options):
        self.options = options
        self.random = random.Random(options.seed)
        self.address = f"127.0.0.1:{free_port()}"
        self.metrics = f"127.0.0.1:{free_port()}"
        self.begun = time.monotonic()
        self.server = self.devices = self.run = self.window = None
        self.request, self.one_shots = [], []
        self.samples = []
        self.events = []
        self.counts = {}
        self.frames = 0
        self.buckets = {}
        self.frame_at = self.recovered_from = time.monotonic()

    # -- Processes

    def start(self, name, *arguments, **more):
        program = "fea-server" if name == "server" else "glove-client"
        log = open(os.path.join(self.options.work, f"{name}.log"), "ab")
        command = [os.path.join(self.options.programs, program), *arguments]
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, **more)

    def start_server(self):
        self.server = self.start(
            "server", "--listen", self.address, "--metrics", self.metrics, "--drain", "2",
        )
        # The counters of a server begin with it.
        self.frames, self.buckets = 0, {}
        self.recovered_from = time.monotonic()

    def start_devices(self):
        faults = self.random.sample(DEVICE_FAULTS, 3)
        options = [word for fault in faults for word in ("--fault", f"{fault}:0.01")]
        self.devices = self.start(
            "devices", "emulate", "--script", "regrasp", "--object", self.options.object,
            "--nodes", str(self.options.nodes), "--link-dir", self.ports(),
            "--seed", str(self.random.randrange(1000)), *options,
        )
        self.recovered_from = time.monotonic()

    def ports(self):
        return os.path.join(self.options.work, "ports")

    def run_options(self):
        return ["run", "--object", self.options.object, "--nodes", str(self.options.nodes),
                "--server", self.address]

    def start_run(self):
        glove, tracker = (os.path.join(self.ports(), name) for name in ("glove", "tracker"))
        self.run = self.start(
            "run", *self.run_options(), "--headless", "--rate", str(self.options.rate),
            "--hand", f"serial:glove={glove},tracker={tracker}",
        )

    # -- What goes wrong

    def happened(self, what):
        self.events.append((time.monotonic() - self.begun, what))
        self.counts[what] = self.counts.get(what, 0) + 1

    def lose_server(self):
        """Kills the server or asks it to end; some seconds later another one listens."""
        if self.random.random() < 0.5:
            self.server.kill()
            self.server.wait(10)
            self.happened("server killed")
        else:
            self.server.terminate()
            code = self.server.wait(20)
            if code != 0:
                raise Failed(f"a server that is asked to end ends with {code}")
            self.happened("server ended")
        time.sleep(self.random.uniform(0.2, 3.0))
        self.start_server()

    def unplug(self):
        """Both devices disappear, and come back with other faults."""
        self.devices.kill()
        self.devices.wait(10)
        self.happened("devices unplugged")
        time.sleep(self.random.uniform(0.2, 3.0))
        self.start_devices()

    def make_request(self):
        """A mesh and prescribed displacements for the requests of their own."""
        files = ("ball.msh", "known.csv", "displacements.csv")
        mesh, known, out = (os.path.join(self.options.work, name) for name in files)
        made = self.start("one-shot", "mesh", "sphere", "--nodes", "1000", "--out", mesh)
        if made.wait(60) != 0:
            raise Failed("no mesh for the requests of their own")
        with open(known, "w") as file:
            file.write("node,ux,uy,uz\n0,0,0,0\n1,0,0,0\n2,0,0,0\n9,0.001,0,0\n")
        self.request = ["solve", "--mesh", mesh, "--known", known, "--out", out,
                        "--server", self.address]

    def ask_once(self):
        """A request of its own, beside the run."""
        self.one_shots.append(self.start("one-shot", *self.request))
        self.happened("request of its own")

    def be_a_stranger(self):
        """Bytes that are no message, and a connection that is left half way."""
        try:
            host, port = self.address.split(":")
            with socket.create_connection((host, int(port)), 2) as peer:
                peer.sendall(self.random.randbytes(self.random.randrange(1, 4096)))
        except OSError:
            pass
        self.happened("nonsense sent")

    def open_or_close_window(self):
        if self.window is not None:
            # A window that found no server has said so and ended by itself.
            code = self.window.poll()
            found_a_server = code is None
            if found_a_server:
                self.window.terminate()
                code = self.window.wait(30)
            self.window = None
            if code not in ((0, -signal.SIGTERM) if found_a_server else (1,)):
                raise Failed(f"a window that is closed ends with {code}")
            self.happened("window closed" if found_a_server else "window without a server")
        elif os.environ.get("SOAK_DISPLAY"):
            display = os.environ["SOAK_DISPLAY"]
            # One thread of the processor draws; the others belong to the run.
            environment = {**os.environ, "DISPLAY": display, "LP_NUM_THREADS": "1"}
            environment.pop("WAYLAND_DISPLAY", None)
            self.window = self.start(
                "window", *self.run_options(), "--hand", "scripted:lift", env=environment,
            )
            self.happened("window opened")

    # -- What is looked at

    def sample(self):
        """A row: memory, frames since the last one, and bounds on their quantiles."""
        now = time.monotonic()
        frames, buckets = self.answered()
        new = max(frames - self.frames, 0)
        counts = {le: count - self.buckets.get(le, 0) for le, count in buckets.items()}
        self.frames, self.buckets = frames, buckets
        if new > 0:
            self.frame_at = now
        waited = now - max(self.frame_at, self.recovered_from)
        if waited > RECOVERY_S:
            raise Failed(f"no frame for {waited:.0f} s with a server and devices")
        if self.run.poll() is not None:
            raise Failed(f"the run has ended with {self.run.returncode}")
        if self.server.poll() is not None:
            raise Failed(f"the server has ended with {self.server.returncode}")
        self.samples.append({
            "seconds": now - self.begun,
            "run_mib": resident_mib(self.run),
            "server_mib": resident_mib(self.server),
            "frames": new,
            "p50_ms": quantile_bound_ms(counts, 0.5),
            "p99_ms": quantile_bound_ms(counts, 0.99),
        })

    def answered(self):
        """Contact frames so far, and how many took at most so many seconds."""
        total, buckets = 0, {}
        try:
            with urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=5) as page:
                for line in page.read().decode().splitlines():
                    if 'kind="ContactFrame"' not in line:
                        continue
                    name, value = line.rsplit(" ", 1)
                    if name.startswith("softgrasp_request_seconds_count"):
                        total = int(value)
                    elif name.startswith("softgrasp_request_seconds_bucket"):
                        bound = name.split('le="')[1].split('"')[0]
                        buckets[float("inf") if bound == "+Inf" else float(bound)] = int(value)
        except OSError:
            return self.frames, self.buckets
        return total, buckets

    def play(self):
        self.make_request()
        self.start_server()
        self.start_devices()
        deadline = time.monotonic() + 20
        while not os.path.exists(os.path.join(self.ports(), "tracker")):
            if time.monotonic() > deadline:
                raise Failed("the emulated devices do not start")
            time.sleep(0.05)
        self.start_run()
        seconds = self.options.seconds
        # In a short soak everything happens once at least.
        faults = [
            (max(seconds / 60, 12), self.lose_server), (max(seconds / 60, 14), self.unplug),
            (max(seconds / 90, 9), self.ask_once), (7, self.be_a_stranger),
            (max(seconds / 40, 11), self.open_or_close_window),
        ]
        due = [(self.begun + 8 + self.random.uniform(0, every), every, act) for every, act in faults]
        while time.monotonic() - self.begun < seconds:
            time.sleep(1.0)
            self.sample()
            for k, (at, every, act) in enumerate(due):
                if time.monotonic() >= at:
                    act()
                    due[k] = (time.monotonic() + self.random.uniform(0.5, 1.5) * every, every, act)
        self.end()

    def end(self):
        if self.window is not None:
            self.open_or_close_window()
        # What was asked while a server was away ends with an error that says so; nothing may hang or crash.
        codes = [process.wait(60) for process in self.one_shots]
        if crashed := [code for code in codes if code < 0 or code == 101]:
            raise Failed(f"requests of their own end with {crashed}")
        answered = codes.count(0)
        self.counts["request of its own answered"] = answered
        if answered * 2 < len(codes):
            raise Failed(f"{answered} of {len(codes)} requests of their own were answered")
        self.run.send_signal(signal.SIGINT)
        if (code := self.run.wait(20)) not in (0, 130, -signal.SIGINT):
            raise Failed(f"the run ends with {code}")
        self.server.terminate()
        if (code := self.server.wait(20)) != 0:
            raise Failed(f"the server ends with {code}")

    def kill_all(self):
        for process in [self.server, self.devices, self.run, self.window, *self.one_shots]:
            if process is not None and process.poll() is None:
                process.kill()

    # -- What must hold at the end

    def judged(self):
        """Names, values and bounds; raises what does not hold."""
        for name in sorted(os.listdir(self.options.work)):
            if name.endswith(".log"):
                with open(os.path.join(self.options.work, name), errors="replace") as log:
                    if "panicked at" in log.read():
                        raise Failed(f"a program has panicked: {name}")
        quarter = len(self.samples) // 4
        rows = []
        for who in ("run", "server"):
            of = [s[f"{who}_mib"] for s in self.samples]
            early = [m for m in of[quarter:2 * quarter] if m is not None]
            late = [m for m in of[3 * quarter:] if m is not None]
            before, after = statistics.median(early), statistics.median(late)
            bound = before * (1 + GROWTH_SHARE) + GROWTH_MIB
            if after > bound:
                raise Failed(f"memory of the {who}: {before:.1f} MiB, later {after:.1f} MiB")
            rows.append((who, before, after, bound))
        if sum(s["frames"] for s in self.samples) == 0:
            raise Failed("no frame was answered at all")
        return rows


def quantile_bound_ms(counts, share):
    """Upper bound of the bucket in which a quantile lies, ms; None without frames."""
    total = max(counts.values(), default=0)
    if total <= 0:
        return None
    return next(1e3 * bound for bound in sorted(counts) if counts[bound] >= share * total)


def write(soak, rows):
    folder, options = soak.options.out, soak.options
    os.makedirs(folder, exist_ok=True)
    names = list(soak.samples[0])
    with open(os.path.join(folder, "soak.csv"), "w") as file:
        file.write(",".join(names) + "\n")
        for sample in soak.samples:
            cells = ("" if sample[n] is None else f"{sample[n]:.6g}" for n in names)
            file.write(",".join(cells) + "\n")
    with open(os.path.join(folder, "soak.svg"), "w") as file:
        file.write(picture(soak.samples, soak.events))
    frames = sum(s["frames"] for s in soak.samples)
    gaps = longest_gap(soak.samples)
    lines = [
        "# A long run beside faults", "",
        f"`tests/soak/run.sh --seconds {options.seconds:g} --rate {options.rate:g} --seed "
        f"{options.seed}`, {time.strftime('%Y-%m-%d')}, {os.cpu_count()} processors "
        f"({platform.machine()}), {platform.system()}, load {os.getloadavg()[2]:.1f}.", "",
        f"One run without a window (`{options.object}`, {options.nodes} nodes, hand by emulated glove and "
        f"tracker, {options.rate:g} ticks a second asked) lived {options.seconds:g} s: "
        f"{frames} frames were answered, those of {frames / 60:.0f} s at 60 a second: between them the hand was "
        f"away, or the devices or the server were. Longest time without one: {gaps:.0f} s.", "",
        "| what happened | times |", "| --- | --: |",
        *(f"| {what} | {count} |" for what, count in sorted(soak.counts.items())), "",
        "| resident memory | second quarter, MiB | last quarter, MiB | allowed, MiB |",
        "| --- | --: | --: | --: |",
        *(f"| {who} | {before:.1f} | {after:.1f} | {bound:.1f} |"
          for who, before, after, bound in rows), "",
        "![Memory and latency](soak.svg)", "",
        "Quantiles are upper bounds of the buckets of the server's metrics. What takes hours by a clock, such "
        "as limits on idle sessions and models, is not compressed and not played here.", "",
    ]
    with open(os.path.join(folder, "soak.md"), "w") as file:
        file.write("\n".join(lines))


def longest_gap(samples):
    """Longest time between two samples with frames, s."""
    at = [s["seconds"] for s in samples if s["frames"] > 0]
    return max((b - a for a, b in zip(at, at[1:])), default=0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--rate", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--object", default="strawberry")
    parser.add_argument("--nodes", type=int, default=800)
    parser.add_argument("--out")
    soak = Soak(parser.parse_args())
    try:
        soak.play()
        rows = soak.judged()
    except Failed as failed:
        print(f"soak: FAILED after {time.monotonic() - soak.begun:.0f} s: {failed}", file=sys.stderr)
        return 1
    finally:
        soak.kill_all()
    if soak.options.out:
        write(soak, rows)
    frames = sum(s["frames"] for s in soak.samples)
    told = ", ".join(f"{what} {count}" for what, count in sorted(soak.counts.items()))
    memory = ", ".join(f"{who} {before:.1f} -> {after:.1f} MiB" for who, before, after, _ in rows)
    print(f"soak: {frames} frames in {soak.options.seconds:g} s; {told}; {memory}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
