"""Checks the JSON report of a run of `glove-client run`.

    python3 tests/operations/report.py REPORT.json --ticks N [--kept | --lost] [--by REASON]
        [--gap-ms MS]

Every tick was played or is counted as skipped, and every deforming tick was answered or has its
reason. --kept: the server was never lost. --lost: it was lost while the object was deformed, and
after the client had found it again there were answers. --by: ticks are unanswered for that reason.
--gap-ms: for a time no answer came, so that the shape shown was so old, and then there were answers
again.
"""

import argparse
import json
import sys


def fail(text):
    sys.exit(f"report: {text}")


def check_counts(report, ticks):
    summary, frames = report["summary"], report["frames"]
    if report["ticks"] != ticks or len(frames) + summary["ticks_skipped"] != ticks:
        fail(f"{len(frames)} ticks played and {summary['ticks_skipped']} skipped, not {ticks}")
    counted = summary["solves"] + sum(summary["unanswered"].values())
    if counted != summary["deforming_ticks"]:
        fail(f"{summary['deforming_ticks']} deforming ticks, {counted} accounted for")
    if not summary["solves"]:
        fail("no tick was answered")


def server_events(report, beginning):
    """Ticks of the events of the server that begin so."""
    events = [e for e in report["events"] if e["kind"] == "server"]
    return [e["tick"] for e in events if e["what"].startswith(beginning)]


def check_loss(report):
    """The tick of the loss, that of the connection after it, and that of the answer after that."""
    states = {frame["tick"]: frame["state"] for frame in report["frames"]}
    lost = [t for t in server_events(report, "lost: ") if states.get(t) == "Deforming"]
    if not lost:
        fail("the server was not lost while the object was deformed")
    again = [t for t in server_events(report, "connected to ") if t >= lost[-1]]
    if not again:
        fail(f"no server was found after the loss in tick {lost[-1]}")
    solved = [f["tick"] for f in report["frames"] if f["solve"] and f["tick"] >= again[0]]
    if not solved:
        fail(f"nothing was answered after the server was found again in tick {again[0]}")
    return lost[-1], again[0], solved[0]


def check_gap(report, gap_ms):
    """The greatest age of the shape shown in a tick, ms; answers must have come after that."""
    at_ms = {frame["tick"]: frame["at_ms"] for frame in report["frames"]}
    ages = [
        (frame["at_ms"] - at_ms[frame["shown_tick"]], frame["tick"])
        for frame in report["frames"]
        if frame["state"] == "Deforming" and frame["shown_tick"] is not None
    ]
    oldest, tick = max(ages)
    if oldest < gap_ms:
        fail(f"answers were never missing for {gap_ms} ms: the oldest shape was {oldest:.0f} ms old")
    if not any(frame["solve"] and frame["tick"] > tick for frame in report["frames"]):
        fail(f"nothing was answered after tick {tick}, {oldest:.0f} ms after the answer before")
    return oldest


def main():
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("report")
    parser.add_argument("--ticks", type=int, required=True)
    parser.add_argument("--kept", action="store_true")
    parser.add_argument("--lost", action="store_true")
    parser.add_argument("--by")
    parser.add_argument("--gap-ms", type=float)
    options = parser.parse_args()
    with open(options.report) as file:
        report = json.load(file)
    check_counts(report, options.ticks)
    summary = report["summary"]
    told = f"{summary['solves']} of {summary['deforming_ticks']} deforming ticks answered"
    if options.kept and (lost := server_events(report, "lost: ")):
        fail(f"the server was lost in the ticks {lost}")
    if options.lost:
        told += ", lost in tick {}, found in {}, answered from {}".format(*check_loss(report))
    if options.by and not summary["unanswered"].get(options.by):
        fail(f"no tick is unanswered by {options.by}: {summary['unanswered']}")
    if options.gap_ms:
        told += f", none for {check_gap(report, options.gap_ms):.0f} ms"
    print(told)


if __name__ == "__main__":
    main()
