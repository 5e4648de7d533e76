"""Looks at the report of a run with hands of an OpenXR runtime. See run.sh.

    check.py REPORT HAND RECORDS    fails unless HAND was followed by at least RECORDS records, and the
                                    object was deformed and answered
"""

import json
import sys

path, hand, records = sys.argv[1], sys.argv[2], int(sys.argv[3])
with open(path, encoding="utf-8") as file:
    report = json.load(file)
summary = report["summary"]
fit = summary["joint_fit"]
told = (f"--hand {hand}: {fit['records']} records, fitted to {1e3 * fit['rms_m']:.1f} mm, "
        f"{summary['deforming_ticks']} deforming ticks, {summary['solves']} answers")
print(f"openxr: {told}", flush=True)
faults = [
    f"the hand is {report['hand']}" if report["hand"] != hand else "",
    "too few records" if fit["records"] < records else "",
    "the object was not touched" if summary["deforming_ticks"] < 20 else "",
    "nothing was answered" if summary["solves"] < 20 else "",
    "the hand fits badly" if not fit["rms_m"] < 0.006 else "",
]
faults = [fault for fault in faults if fault]
if faults:
    sys.exit(f"openxr: FAILED: {', '.join(faults)}: {told}")
