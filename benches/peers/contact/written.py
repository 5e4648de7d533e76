"""The report of the lift: its tables, its text, its picture."""

import page
import picture
import text

TITLE = "Contact: the same lift in MuJoCo, Rapier and Softgrasp"


def tables():
    return {
        "speeds": page.Table("Time of a frame of a sixtieth of a second", [
            "side", "nodes", "settings", "steps_per_frame", "p50_ms", "cpu_p50_ms", "p99_ms",
            "slowest_ms", "slowest_closing_ms", "call_p50_ms", "frames", "rounds",
        ]),
        "results": page.Table("What comes out", [
            "side", "nodes", "case", "asked_force_n", "force_on_table_n", "force_held_n",
            "rise_mm", "indentation_mm", "outcome", "must", "sink_m_per_s", "slip_m",
            "penetration_max_m", "balance_error_rel", "residual_rel_max", "steps_not_met",
        ]),
        "tried": page.Table("Other settings", [
            "side", "settings", "firm", "firm_sink_m_per_s", "near_the_limit",
            "near_sink_m_per_s", "penetration_max_m", "p50_ms",
        ]),
    }


STEMS = {"speeds": "contact-peers-frames", "results": "contact-peers",
         "tried": "contact-peers-tried"}


def rows_of(table):
    """Rows as dictionaries."""
    return [dict(zip(table.columns, row)) for row in table.rows]


def lifted(tables):
    """Name, nodes, ms and m/s of what lifts the ball firmly, once for each way."""
    speeds, points = rows_of(tables["speeds"]), []
    for row in rows_of(tables["results"]):
        if row["case"] != "firm" or row["outcome"] != "is lifted":
            continue
        of_way = [one for one in speeds
                  if (one["side"], one["nodes"]) == (row["side"], row["nodes"])]
        points += [(row["side"], row["nodes"], one["p50_ms"].median, row["sink_m_per_s"])
                   for one in of_way[:1]]
    return points


def write(folder, head, tables):
    picture.draw(lifted(tables), folder / "contact-peers.svg")
    sections = [
        text.TASK, text.findings(rows_of(tables["speeds"]), rows_of(tables["results"])),
        text.PICTURE, tables["results"], text.RESULTS, tables["speeds"], text.SPEEDS,
        tables["tried"], text.TRIED,
    ]
    for name, stem in STEMS.items():
        page.write(folder, stem, TITLE, head, [tables[name]])
        (folder / f"{stem}.md").unlink()
    lines = [f"# {TITLE}", ""]
    for name, value in head.items():
        lines.append(f"- {name}: `{value}`" if name == "command" else f"- {name}: {value}")
    for section in sections:
        lines += ["", section.markdown() if isinstance(section, page.Table) else section.strip()]
    lines += ["", ", ".join(f"[{stem}.csv]({stem}.csv)" for stem in STEMS.values()), ""]
    (folder / "contact-peers.md").write_text("\n".join(lines))
