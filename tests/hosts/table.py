"""One row of a table in Markdown out of the report of a run in real time.

    python3 tests/hosts/table.py head
    python3 tests/hosts/table.py row NAME REPORT.json RATE

The age of the shown shape is told at each tick in which the fingers deform the object: the time
since the tick whose answer is shown. Bytes are those of the protocol, headers of frames included
and those of TCP and TLS not.
"""

import json
import sys

COLUMNS = (
    "link",
    "ticks",
    "skipped",
    "deforming",
    "answered",
    "answers per second",
    "age p50 ms",
    "age p99 ms",
    "age max ms",
    "round trip p50 ms",
    "round trip p99 ms",
    "request bytes",
    "answer bytes",
    "losses",
)


def head():
    print("| " + " | ".join(COLUMNS) + " |")
    print("| :-- |" + " --: |" * (len(COLUMNS) - 1))


def row(name, path, rate):
    with open(path) as file:
        report = json.load(file)
    summary = report["summary"]
    solves, deforming = summary["solves"], summary["deforming_ticks"]
    losses = sum(event["what"].startswith("lost: ") for event in report["events"])
    cells = [name, report["ticks"], summary["ticks_skipped"], deforming, solves]
    cells.append(f"{solves * rate / deforming:.1f}")
    cells += [three_digits(summary[f"shown_age_ms_{part}"]) for part in ("p50", "p99", "max")]
    cells += [three_digits(summary[f"round_trip_ms_{part}"]) for part in ("p50", "p99")]
    cells += [round(summary[key] / solves) for key in ("bytes_sent", "bytes_received")]
    print("| " + " | ".join(map(str, [*cells, losses])) + " |")


def three_digits(number):
    """At least three digits that count, and no power of ten."""
    digits = 0 if number >= 100 else 1 if number >= 10 else 2 if number >= 1 else 3
    return f"{number:.{digits}f}"


if __name__ == "__main__":
    if sys.argv[1] == "head":
        head()
    else:
        row(sys.argv[2], sys.argv[3], float(sys.argv[4]))
