"""Compares what two recordings of `glove-client run --record` were answered, bit by bit.

    python3 tests/operations/recordings.py compare FIRST.mcap SECOND.mcap [--every] [--at-least N]
    python3 tests/operations/recordings.py await GROWING.mcap [--ticks N] [--answers N]

Of each answer that a tick shows, a recording has the digest of what was asked and the digest of the
displacements that came. Equal questions must have equal displacements, in whatever tick they were
asked; this holds for linear elasticity only. With --every the two must have asked and shown the
same in every deforming tick. `await`
returns once a run that goes on has played so many ticks and shown so many answers.
"""

import argparse
import json
import struct
import sys
import time

MAGIC = b"\x89MCAP0\r\n"
CHANNEL, MESSAGE, CHUNK = 4, 5, 6
# Seconds after which a run hangs; far more than a busy machine takes.
AWAIT_S = 30


def fail(text):
    sys.exit(f"recordings: {text}")


def records(data):
    """Kind and content of each record of an MCAP file or of a chunk of one."""
    at = 0
    while at + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, at)
        at += 9
        if at + length > len(data):
            return
        yield kind, data[at : at + length]
        at += length


def text_at(data, at):
    (length,) = struct.unpack_from("<I", data, at)
    return data[at + 4 : at + 4 + length].decode(), at + 4 + length


def messages(data, topics):
    """Topic and content of each message, in the order in which they were written."""
    for kind, content in records(data):
        if kind == CHUNK:
            compression, at = text_at(content, 28)
            if compression:
                fail(f"the file is compressed ({compression})")
            yield from messages(content[at + 8 :], topics)
        elif kind == CHANNEL:
            (number,) = struct.unpack_from("<H", content)
            topics[number] = text_at(content, 4)[0]
        elif kind == MESSAGE:
            (number,) = struct.unpack_from("<H", content)
            yield topics[number], json.loads(content[22:])


class Recording:
    """Questions, shown answers and events of a run."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        if not data.startswith(MAGIC):
            raise ValueError(f"{path} is no MCAP file")
        self.path = path
        self.questions, self.shown, self.last_tick = {}, {}, -1
        of_tick = None
        for topic, message in messages(data[len(MAGIC) :], {}):
            if topic == "/tick":
                of_tick = self.add(message, of_tick)

    def add(self, message, shown):
        """Adds a tick; `shown` and the result are ticks whose answer is shown."""
        self.last_tick = tick = message["tick"]
        stages = message["stages"]
        if stages["request"]:
            self.questions[tick] = stages["request"]
        asked = [answer for answer in message["answers"] if answer in self.questions]
        shown = max(asked) if asked else shown
        if asked and message["state"] == "Deforming":
            self.shown[shown] = stages["displacement"]
        return shown

    def answers(self):
        """Displacements by question."""
        found = {}
        for tick, displacement in self.shown.items():
            question = self.questions[tick]
            if found.setdefault(question, displacement) != displacement:
                fail(f"{self.path}: tick {tick} asks the same as another and is answered otherwise")
        return found


def compare(first, second):
    """Number of questions that both asked; every one must be answered alike."""
    answered = first.answers()
    common = 0
    for question, displacement in second.answers().items():
        if question in answered:
            common += 1
            if answered[question] != displacement:
                tick = next(t for t in second.shown if second.questions[t] == question)
                fail(f"the answer of tick {tick} has other bits")
    return common


def compare_every(first, second):
    """Number of answers; both must have asked and shown the same in the same ticks."""
    for what, one, other in (
        ("asked", first.questions, second.questions),
        ("shown", first.shown, second.shown),
    ):
        for tick in sorted({*one, *other}):
            if one.get(tick) != other.get(tick):
                fail(f"what is {what} in tick {tick} differs")
    return len(first.shown)


def await_answers(path, ticks, answers):
    """Returns once a recording that grows has so many ticks and shows so many answers."""
    deadline = time.monotonic() + AWAIT_S
    while time.monotonic() < deadline:
        try:
            growing = Recording(path)
            if growing.last_tick + 1 >= ticks and len(growing.shown) >= answers:
                return
        except (OSError, ValueError):
            # Not there yet, or nothing in it yet.
            pass
        time.sleep(0.05)
    fail(f"{path} does not have {ticks} ticks and {answers} answers within {AWAIT_S} s")


def main():
    parser = argparse.ArgumentParser(allow_abbrev=False)
    commands = parser.add_subparsers(dest="command", required=True)
    comparing = commands.add_parser("compare")
    comparing.add_argument("first")
    comparing.add_argument("second")
    comparing.add_argument("--every", action="store_true")
    comparing.add_argument("--at-least", type=int, default=1)
    awaiting = commands.add_parser("await")
    awaiting.add_argument("path")
    awaiting.add_argument("--ticks", type=int, default=0)
    awaiting.add_argument("--answers", type=int, default=0)
    options = parser.parse_args()
    if options.command == "await":
        return await_answers(options.path, options.ticks, options.answers)
    first, second = Recording(options.first), Recording(options.second)
    common = (compare_every if options.every else compare)(first, second)
    if common < options.at_least:
        fail(f"only {common} questions were asked by both, not {options.at_least}")
    print(f"{common} answers are the same bit by bit")


if __name__ == "__main__":
    main()
