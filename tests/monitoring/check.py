"""Compares what a server tells (/metrics, saved in a file) with dashboard, alerts and page.

    python3 tests/monitoring/check.py METRICS DASHBOARD.json ALERTS.yml OPERATIONS.md

Every metric and every value of a label that a query names must be there; every metric that is there must
be in a query of the dashboard or in LEFT_OUT, and in the table of the page; so must every alert.
"""

import json
import re
import sys
from pathlib import Path

# Metrics that the dashboard leaves out, each with its reason; there is none.
LEFT_OUT = {}
# What Prometheus itself says of a target.
OF_PROMETHEUS = {"up"}
# Words of the query language that are no names; functions stand before a bracket.
WORDS = {"and", "or", "unless", "bool", "offset", "by", "without", "on", "ignoring", "inf", "nan"}
PARTS = ("_bucket", "_sum", "_count")
FAMILY = re.compile(r"# TYPE (\S+) (\S+)")
SAMPLE = re.compile(r"([a-zA-Z_:][\w:]*)(?:\{(.*)\})? \S+")
LABEL = re.compile(r'(\w+)="([^"]*)"')
# A matcher of one value; those with a variable of the dashboard are left out.
EQUALS = re.compile(r'(\w+)\s*=\s*"([^"$]*)"')
NAME = re.compile(r"(?<![\w$.])[a-zA-Z_:][\w:]*(?!\s*\()(?![\w:])")


def read_metrics(path):
    """Families with their types, names of samples, and values of each label."""
    types, samples, values = {}, set(), {}
    for line in Path(path).read_text().splitlines():
        if match := FAMILY.match(line):
            types[match[1]] = match[2]
        elif match := SAMPLE.fullmatch(line):
            samples.add(match[1])
            for label, value in LABEL.findall(match[2] or ""):
                values.setdefault(label, set()).add(value)
    return types, samples, values


def family(sample, types):
    for part in PARTS:
        if sample.endswith(part) and types.get(sample[: -len(part)]) == "histogram":
            return sample[: -len(part)]
    return sample


def names(query):
    """Names of metrics in a query."""
    query = re.sub(r'"[^"]*"', '""', query)
    query = re.sub(r"\{[^}]*\}|\[[^\]]*\]", " ", query)
    lists = r"\b(by|without|on|ignoring|group_left|group_right)\s*\([^)]*\)"
    query = re.sub(lists, " ", query)
    return {name for name in NAME.findall(query) if name.lower() not in WORDS}


def queries_of(value):
    """Every query in the dashboard: of its panels and of its variables."""
    if isinstance(value, dict):
        if isinstance(value.get("expr"), str):
            yield value["expr"]
        if str(value.get("definition", "")).startswith("label_values("):
            yield re.sub(r"label_values\((.*), *\w+\)", r"\1", value["definition"])
        for inner in value.values():
            yield from queries_of(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from queries_of(inner)


def queries_of_alerts(text):
    """Queries of the rules, on one line or folded (no YAML reader is needed for these two forms)."""
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if match := re.match(r"( +)expr: (.*)", line):
            query = [] if match[2] == ">-" else [match[2]]
            for below in lines[number + 1 :]:
                if (query and match[2] != ">-") or not below.startswith(match[1] + "  "):
                    break
                query.append(below.strip())
            yield " ".join(query)


def faults(metrics, dashboard, alerts, page):
    types, samples, values = read_metrics(metrics)
    of_dashboard = list(queries_of(json.loads(Path(dashboard).read_text())))
    of_alerts = list(queries_of_alerts(Path(alerts).read_text()))
    assert len(types) > 15, f"only {len(types)} metrics: the server is not started with all of them"
    assert len(of_dashboard) > 20 and len(of_alerts) > 10, "queries are not found"
    for where, queries in ((dashboard, of_dashboard), (alerts, of_alerts)):
        for query in queries:
            for name in names(query) - samples - OF_PROMETHEUS:
                yield f"{where}: the server has no {name}: {query}"
            for label, value in EQUALS.findall(query):
                if label not in ("job", "instance") and value not in values.get(label, ()):
                    yield f'{where}: nothing has {label}="{value}": {query}'
    shown = {family(name, types) for query in of_dashboard for name in names(query)}
    for name in types.keys() - shown - LEFT_OUT.keys():
        yield f"{dashboard} does not show {name}, and LEFT_OUT has no reason for it"
    for name in LEFT_OUT.keys() & shown | LEFT_OUT.keys() - types.keys():
        yield f"LEFT_OUT has {name}, which is shown or is not there"
    table = re.findall(r"`([a-z_]+)(?:\{\w+\})?`", Path(page).read_text())
    for name in types:
        if name.removeprefix("softgrasp_") not in table:
            yield f"{page} does not explain {name}"
    for alert in re.findall(r"- alert: (\w+)", Path(alerts).read_text()):
        if f"`{alert}`" not in Path(page).read_text():
            yield f"{page} does not explain {alert}"
    told = f"{len(types)} metrics; {len(of_dashboard)} queries of the dashboard"
    print(f"{told}, {len(of_alerts)} of alerts")


if __name__ == "__main__":
    found = list(faults(*sys.argv[1:]))
    if found:
        sys.exit("\n".join(found))
