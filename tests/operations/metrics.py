"""Asks a server's metrics port, and checks that what comes is well formed.

    python3 tests/operations/metrics.py HOST:PORT status /ready
    python3 tests/operations/metrics.py HOST:PORT save FILE
    python3 tests/operations/metrics.py HOST:PORT grown FILE WORD...
    python3 tests/operations/metrics.py HOST:PORT value NAME [LABEL]

`status` prints the code and the text. `save` checks /metrics and keeps it; `grown` checks it again:
no counter is smaller than in the file, and each word is in the name of one that is larger. `value`
prints a metric, or the sum of those with this label where there are several.
"""

import json
import re
import sys
import urllib.error
import urllib.request

NAME = r"[a-zA-Z_:][a-zA-Z0-9_:]*"
LABEL = r'[a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\\n]|\\["\\n])*"'
SAMPLE = re.compile(rf"({NAME})(?:\{{({LABEL}(?:,{LABEL})*,?)?\}})? (\S+)(?: -?\d+)?")
HELP = re.compile(rf"# HELP ({NAME}) \S.*")
TYPE = re.compile(rf"# TYPE ({NAME}) (counter|gauge|histogram|summary|untyped)")
# What a histogram's samples are called behind its name.
PARTS = ("_bucket", "_sum", "_count")


def fail(text):
    sys.exit(f"metrics: {text}")


def get(address, path):
    try:
        with urllib.request.urlopen(f"http://{address}{path}", timeout=5) as answer:
            return answer.status, answer.headers, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read().decode()
    except OSError as error:
        return 0, {}, str(error)


def family(name, types):
    """The metric that a sample belongs to."""
    for part in PARTS:
        if name.endswith(part) and types.get(name[: -len(part)]) in ("histogram", "summary"):
            return name[: -len(part)]
    return name


def read(address):
    """Samples and types of /metrics; fails where a line is not well formed."""
    status, headers, text = get(address, "/metrics")
    if status != 200:
        fail(f"/metrics answers {status} {text}")
    if not headers.get("Content-Type", "").startswith("text/plain"):
        fail(f"the content type is {headers.get('Content-Type')!r}")
    if not text.endswith("\n"):
        fail("the last line has no end")
    samples, types, helps = {}, {}, set()
    for line in text.splitlines():
        if match := HELP.fullmatch(line):
            helps.add(match[1])
        elif match := TYPE.fullmatch(line):
            if match[1] in types:
                fail(f"{match[1]} has two types")
            types[match[1]] = match[2]
        elif match := SAMPLE.fullmatch(line):
            add(samples, match, types, helps)
        elif line:
            fail(f"not well formed: {line!r}")
    check_histograms(samples, types)
    if not samples:
        fail("there is nothing in it")
    return samples, types


def add(samples, match, types, helps):
    name, labels, value = match.groups()
    of = family(name, types)
    if of not in types or of not in helps:
        fail(f"{name} has no # HELP or no # TYPE before it")
    if types[of] == "counter" and not name.endswith("_total"):
        fail(f"the counter {name} does not end in _total")
    key = (name, labels or "")
    if key in samples:
        fail(f"{key} is there twice")
    samples[key] = float(value)


def check_histograms(samples, types):
    """Buckets grow, and the last one, +Inf, is the count."""
    for name in (name for name, kind in types.items() if kind == "histogram"):
        series = {}
        for (sample, labels), value in samples.items():
            if sample == f"{name}_bucket":
                bound = re.search(r'le="([^"]*)"', labels)[1]
                others = re.sub(r'(^|,)le="[^"]*",?', r"\1", labels).strip(",")
                series.setdefault(others, []).append((float(bound), value))
        for labels, buckets in series.items():
            counts = [count for _, count in sorted(buckets)]
            if counts != sorted(counts) or max(buckets)[0] != float("inf"):
                fail(f"the buckets of {name} do not grow up to +Inf: {buckets}")
            if samples.get((f"{name}_count", labels)) != counts[-1]:
                fail(f"the last bucket of {name} is not its count")


def save(address, path):
    samples, types = read(address)
    with open(path, "w") as file:
        json.dump([[*key, value] for key, value in samples.items()], file)
    print(f"{len(types)} metrics, {len(samples)} samples, well formed")


def grown(address, path, words):
    with open(path) as file:
        before = {(name, labels): value for name, labels, value in json.load(file)}
    samples, types = read(address)
    def counts(key):
        return types.get(family(key[0], types)) in ("counter", "histogram")

    counters = {key: value for key, value in samples.items() if counts(key)}
    for key, value in before.items():
        if counts(key) and counters.get(key, -1.0) < value:
            fail(f"the counter {key} went from {value} to {counters.get(key)}")
    larger = {k for k, v in counters.items() if v > before.get(k, 0.0)}
    for word in words:
        if not any(word in f"{name} {labels}" for name, labels in larger):
            fail(f"no counter of '{word}' has grown")
    print(f"{len(larger)} counters have grown")


def main():
    address, command, *rest = sys.argv[1:]
    if command == "status":
        status, _, text = get(address, rest[0])
        print(status, text.strip())
    elif command == "save":
        save(address, rest[0])
    elif command == "grown":
        grown(address, rest[0], rest[1:])
    else:
        samples, _ = read(address)
        label = rest[1] if len(rest) > 1 else ""
        found = [v for (name, labels), v in samples.items() if name == rest[0] and label in labels]
        if not found:
            fail(f"there is no {' '.join(rest)}")
        print(f"{sum(found):g}")


if __name__ == "__main__":
    main()
