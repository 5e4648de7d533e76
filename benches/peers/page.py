"""The report: head, text and tables, as Markdown for people and CSV for programs."""

import datetime
import os
import platform
import re
import statistics
import subprocess
from pathlib import Path

from sides import ROOT


def first_match(pattern, path):
    try:
        found = re.search(pattern, path.read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found.group(1).strip().strip('"') if found else "unknown"


def output(*command):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else None


def commit():
    head = output("git", "rev-parse", "--short=12", "HEAD")
    changes = output("git", "status", "--porcelain", "--", ":/", ":(top,exclude)reports")
    if head is None:
        return "unknown"
    return f"{head} + changes" if changes else head


def processor_maker():
    """Who made the processor, for a claim about a library of one maker on a machine of another."""
    vendor = first_match(r"^vendor_id\s*: (.*)$", Path("/proc/cpuinfo"))
    return {"AuthenticAMD": "AMD", "GenuineIntel": "Intel"}.get(vendor, vendor)


def load():
    return f"{os.getloadavg()[0]:.2f}"


def machine():
    """Head of the report, with the names and in the order of the other reports."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    system = first_match(r"^PRETTY_NAME=(.*)$", Path("/etc/os-release"))
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "commit": commit(),
        "processor": first_match(r"^model name\s*: (.*)$", Path("/proc/cpuinfo")),
        "processors": str(len(os.sched_getaffinity(0))),
        "memory": f"{memory:.0f} GiB",
        "system": f"{system}, kernel {platform.release()}, {platform.machine()}",
        "compiler": f"{output('rustc', '--version')}, release",
        "load before": load(),
    }


class Spread:
    """Median and extremes."""

    def __init__(self, values):
        self.median = statistics.median(values)
        self.min = min(values)
        self.max = max(values)


def ratio(dividends, divisors):
    """Median over the rounds of the quotient of two competitors."""
    return statistics.median(a / b for a, b in zip(dividends, divisors))


def three_digits(x):
    if x == 0:
        return "0"
    if not 1e-3 <= abs(x) < 1e5:
        return f"{x:.1e}"
    before_point = len(str(int(abs(x)))) if abs(x) >= 1 else 0
    return f"{x:.{max(0, 3 - before_point)}f}"


def spread_text(spread):
    """`median (min..max)`."""
    low, high = three_digits(spread.min), three_digits(spread.max)
    return f"{three_digits(spread.median)} ({low}..{high})"


class Table:
    """Columns `name_unit`; a cell may be text, a number, a `Spread` or None."""

    def __init__(self, title, columns):
        self.title, self.columns, self.rows = title, columns, []

    def push(self, *cells):
        self.rows.append(cells)

    def markdown(self):
        heads = " | ".join(name.replace("_", " ") for name in self.columns)
        texts = [isinstance(cell, str) for cell in self.rows[0]]
        lines = [f"### {self.title}", "", f"| {heads} |"]
        lines.append("| " + " | ".join(":--" if text else "--:" for text in texts) + " |")
        lines += ["| " + " | ".join(map(markdown_cell, row)) + " |" for row in self.rows]
        return "\n".join(lines)

    def csv_rows(self):
        """As a list of dictionaries; a spread is three columns."""
        for row in self.rows:
            cells = {"table": self.title}
            for name, cell in zip(self.columns, row):
                if isinstance(cell, Spread):
                    stem, unit = name.rsplit("_", 1)
                    cells[name] = cell.median
                    cells[f"{stem}_min_{unit}"], cells[f"{stem}_max_{unit}"] = cell.min, cell.max
                else:
                    cells[name] = cell
            yield cells


def markdown_cell(cell):
    if cell is None:
        return "–"
    if isinstance(cell, Spread):
        return spread_text(cell)
    return three_digits(cell) if isinstance(cell, float) else str(cell)


def csv_cell(cell):
    if cell is None:
        return ""
    text = f"{cell:.5e}" if isinstance(cell, float) else str(cell)
    return f'"{text}"' if "," in text else text


def write(folder, stem, title, head, sections):
    """Writes `stem.md` and `stem.csv`: all tables in one, with the columns of all."""
    tables = [section for section in sections if isinstance(section, Table)]
    lines = [f"# {title}", ""]
    for name, value in head.items():
        lines.append(f"- {name}: `{value}`" if name == "command" else f"- {name}: {value}")
    for section in sections:
        lines += ["", section.markdown() if isinstance(section, Table) else section.strip()]
    lines += ["", f"[{stem}.csv]({stem}.csv)", ""]
    (folder / f"{stem}.md").write_text("\n".join(lines))
    rows = [row for table in tables for row in table.csv_rows()]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    lines = [f"# {name}: {value}" for name, value in head.items()]
    lines.append(",".join(columns))
    lines += [",".join(csv_cell(row.get(name)) for name in columns) for row in rows]
    (folder / f"{stem}.csv").write_text("\n".join(lines) + "\n")
