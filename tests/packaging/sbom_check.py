"""Holds the list of contents (CycloneDX) and the licences of others against cargo and Cargo.lock.

    python3 tests/packaging/sbom_check.py BOM.cdx.json THIRD-PARTY-LICENSES.md TARGET
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

bom_path, licences_path, target = sys.argv[1:]
bom = json.loads(Path(bom_path).read_text())
listed = {(c["name"], c["version"]): c for c in bom["components"]}
assert len(listed) == len(bom["components"]), "a package is there twice"


def tree(program):
    """What cargo says that a program links, asked for each program by itself."""
    command = ["cargo", "tree", "--locked", "--edges", "normal", "--prefix", "none", "--no-dedupe"]
    command += ["--package", program, "--target", target, "--format", "{p}"]
    # As packaging/release.sh builds it.
    command += ["--features", f"{program}/otlp"]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    lines = (line.split() for line in told.splitlines() if line)
    return {(words[0], words[1].removeprefix("v")) for words in lines}


linked = tree("fea-server") | tree("glove-client")
missing, more = linked - listed.keys(), listed.keys() - linked
assert not missing, f"not in the list: {sorted(missing)}"
assert not more, f"linked by no program: {sorted(more)}"

with open("Cargo.lock", "rb") as file:
    locked = {(p["name"], p["version"]): p.get("checksum") for p in tomllib.load(file)["package"]}
for name, component in listed.items():
    sums = [one["content"] for one in component.get("hashes", [])]
    assert sums == ([locked[name]] if locked[name] else []), f"{name}: not what Cargo.lock has"
    assert component["licenses"][0]["expression"], f"{name} has no licence"
for of_tests in ("proptest", "spdx", "parry3d", "plotters", "clap_mangen", "clap_complete"):
    assert of_tests not in {name for name, _ in listed}, f"{of_tests} is in no program"

refs = {bom["metadata"]["component"]["bom-ref"], *(c["bom-ref"] for c in listed.values())}
assert {entry["ref"] for entry in bom["dependencies"]} == refs
for entry in bom["dependencies"]:
    assert refs.issuperset(entry["dependsOn"]), f"{entry['ref']} needs what is not listed"

licences = Path(licences_path).read_text()
own = {name for name in listed if locked[name] is None}
for name, version in listed.keys() - own:
    assert f"| {name} | {version} |" in licences, f"{name} {version}: no licence is told"
print(f"{len(listed)} packages, {len(own)} of them ours, as cargo and Cargo.lock have them")
