"""A network link in one process: a TCP proxy that delays, limits and stalls what passes.

    python3 tests/hosts/link.py --listen HOST:PORT --to HOST:PORT [--delay-ms 20] [--jitter-ms 5]
        [--rate-mbit 10] [--stall-every 50] [--stall-ms 200] [--pause-s 2] [--cut-s 3] [--seed 1]

Each direction is a line of its own: bytes leave it in the order in which they came in, cut into
pieces of one packet. A piece waits for the line (rate), then it travels (delay and jitter). Every
so many pieces on average one is lost and comes again after the time of a retransmission; what
follows it waits, as TCP makes it wait. The two signals disturb all connections at once:

    SIGUSR1   nothing passes for --pause-s, then all of it does
    SIGUSR2   what is open is silent for good, and what is opened within --cut-s is silent too;
              nobody is told: the other host has vanished, and comes back under the same address

The first line on standard output is the address; a port 0 picks a free one.
"""

import argparse
import collections
import random
import signal
import socket
import sys
import threading
import time

# Payload of one packet on an Ethernet with TCP's time stamps, bytes.
PACKET = 1448
# Bytes that may be on the way in one direction, as the window of TCP limits them.
IN_FLIGHT_MAX = 256 << 10
# An end of a connection that stands in the line behind its last bytes.
END = b""


class Weather:
    """What all connections have in common: pauses and cuts."""

    def __init__(self, options):
        self.options = options
        self.lock = threading.Lock()
        self.paused_until = 0.0
        self.cut_until = 0.0
        self.cuts = 0

    def pause(self, *_):
        self.paused_until = time.monotonic() + self.options.pause_s

    def cut(self, *_):
        self.cut_until = time.monotonic() + self.options.cut_s
        self.cuts += 1


class Line:
    """One direction of one connection."""

    def __init__(self, weather, source, target, chance):
        self.weather, self.source, self.target, self.chance = weather, source, target, chance
        self.born = weather.cuts
        self.dead = time.monotonic() < weather.cut_until
        self.pieces = collections.deque()
        self.in_flight = 0
        self.changed = threading.Condition()
        self.free_at = self.last_arrival = 0.0

    def start(self):
        for work in (self.take_in, self.give_out):
            threading.Thread(target=work, daemon=True).start()

    def is_silent(self):
        return self.dead or self.weather.cuts != self.born

    def arrival(self, length):
        """When a piece that comes in now comes out."""
        options = self.weather.options
        start = max(time.monotonic(), self.free_at)
        seconds = length * 8 / (options.rate_mbit * 1e6) if options.rate_mbit else 0.0
        self.free_at = start + seconds
        travels = options.delay_ms + options.jitter_ms * self.chance.random()
        if options.stall_every and self.chance.random() * options.stall_every < 1:
            travels += options.stall_ms
        # Order is kept: nothing overtakes.
        self.last_arrival = max(self.last_arrival, self.free_at + travels / 1e3)
        return self.last_arrival

    def put(self, piece):
        with self.changed:
            self.changed.wait_for(lambda: self.in_flight < IN_FLIGHT_MAX)
            self.pieces.append((self.arrival(len(piece)), piece))
            self.in_flight += len(piece)
            self.changed.notify_all()

    def take_in(self):
        try:
            while read := self.source.recv(1 << 16):
                for start in range(0, len(read), PACKET):
                    self.put(read[start : start + PACKET])
        except OSError:
            pass
        self.put(END)

    def next_piece(self):
        with self.changed:
            self.changed.wait_for(lambda: self.pieces)
            due, piece = self.pieces[0]
        while (rest := max(due, self.weather.paused_until) - time.monotonic()) > 0:
            # A pause may begin while a piece is on its way.
            time.sleep(min(rest, 0.05))
        with self.changed:
            self.pieces.popleft()
            self.in_flight -= len(piece)
            self.changed.notify_all()
        return piece

    def give_out(self):
        try:
            while piece := self.next_piece():
                if not self.is_silent():
                    self.target.sendall(piece)
            if not self.is_silent():
                self.target.shutdown(socket.SHUT_WR)
        except OSError:
            # Whoever reads here is gone; whoever writes is told, unless nobody is to be told.
            if not self.is_silent():
                close(self.source)


def close(connection):
    try:
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:
        pass


def attend(client, weather, seed):
    """Passes on one connection."""
    try:
        server = socket.create_connection(weather.options.to, timeout=5)
    except OSError:
        client.close()
        return
    server.settimeout(None)
    for connection in (client, server):
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    Line(weather, client, server, random.Random(f"{seed} to the server")).start()
    Line(weather, server, client, random.Random(f"{seed} to the client")).start()


def address(text):
    host, port = text.rsplit(":", 1)
    return host, int(port)


def options():
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("--listen", type=address, required=True)
    parser.add_argument("--to", type=address, required=True)
    parser.add_argument("--seed", type=int, default=1998)
    for name in ("delay-ms", "jitter-ms", "rate-mbit", "stall-every"):
        parser.add_argument(f"--{name}", type=float, default=0.0)
    parser.add_argument("--stall-ms", type=float, default=200.0)
    parser.add_argument("--pause-s", type=float, default=2.0)
    parser.add_argument("--cut-s", type=float, default=3.0)
    return parser.parse_args()


def main():
    weather = Weather(options())
    signal.signal(signal.SIGUSR1, weather.pause)
    signal.signal(signal.SIGUSR2, weather.cut)
    listener = socket.create_server(weather.options.listen)
    print("link on {}:{}".format(*listener.getsockname()), flush=True)
    count = 0
    while True:
        client, _ = listener.accept()
        count += 1
        seed = f"{weather.options.seed} {count}"
        threading.Thread(target=attend, args=(client, weather, seed), daemon=True).start()


if __name__ == "__main__":
    sys.exit(main())
