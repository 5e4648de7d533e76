"""The report of the lift: its tables, its text, its picture."""

import page
import task

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


def write(folder, head, tables):
    import text
    sections = [text.TASK, tables["speeds"], text.SPEEDS, tables["results"], text.RESULTS,
                tables["tried"], text.TRIED]
    stems = {"speeds": "contact-peers-frames", "results": "contact-peers", "tried":
             "contact-peers-tried"}
    for name, stem in stems.items():
        page.write(folder, stem, TITLE, head, [tables[name]])
    lines = [f"# {TITLE}", ""]
    for name, value in head.items():
        lines.append(f"- {name}: `{value}`" if name == "command" else f"- {name}: {value}")
    for section in sections:
        lines += ["", section.markdown() if isinstance(section, page.Table) else section.strip()]
    lines += ["", ", ".join(f"[{stem}.csv]({stem}.csv)" for stem in stems.values()), ""]
    for stem in stems.values():
        (folder / f"{stem}.md").unlink()
    (folder / "contact-peers.md").write_text("\n".join(lines))
