"""Writes the list of everything that the programs are built from (CycloneDX 1.5, JSON).

    python3 packaging/sbom.py TARGET OUT.cdx.json

TARGET is Rust's name of a platform, as x86_64-unknown-linux-gnu. Listed is what both programs link there:
packages of the lock file that they need, directly or not, without those that only build or test. Python's
standard library and cargo are all that is needed. SOURCE_DATE_EPOCH sets the time that is written.
"""

import datetime
import json
import os
import re
import subprocess
import sys
import tomllib
import uuid
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAMS = ("fea-server", "glove-client")
# As packaging/release.sh builds them.
FEATURES = "fea-server/otlp,glove-client/otlp"


def metadata(target):
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", target]
    told = subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return json.loads(told.stdout)


def built_for(target):
    """Name and version of each package that cargo builds for the programs, by the features they ask for.

    `cargo metadata` counts the features that tests and reports of the workspace ask for too.
    """
    command = ["cargo", "tree", "--locked", "--edges", "normal", "--prefix", "none"]
    command += ["--format", "{p}", "--target", target, "--features", FEATURES]
    for name in PROGRAMS:
        command += ["--package", name]
    told = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    lines = (line.split() for line in told.stdout.splitlines() if line)
    return {(words[0], words[1].removeprefix("v")) for words in lines}


def linked(target):
    """Packages that the programs link, in the order of their names, and what each of them needs."""
    told, built = metadata(target), built_for(target)
    packages = {
        package["id"]: package
        for package in told["packages"]
        if (package["name"], package["version"]) in built
    }
    nodes = {node["id"]: node for node in told["resolve"]["nodes"]}
    # Macros work while something is built, but what they write is in the programs.
    needs = {
        name: sorted(
            dependency["pkg"]
            for dependency in nodes[name]["deps"]
            if dependency["pkg"] in packages
            and any(kind["kind"] is None for kind in dependency["dep_kinds"])
        )
        for name in packages
    }
    found = sorted(needs, key=lambda name: (packages[name]["name"], packages[name]["version"]))
    return [packages[name] for name in found], needs


def checksums():
    with (ROOT / "Cargo.lock").open("rb") as file:
        locked = tomllib.load(file)["package"]
    return {(p["name"], p["version"]): p["checksum"] for p in locked if "checksum" in p}


def expression(package):
    """Licence as SPDX writes it; older manifests have a stroke for OR."""
    licence = package["license"]
    return None if licence is None else re.sub(r"\s*/\s*", " OR ", licence)


def purl(package):
    return f"pkg:cargo/{package['name']}@{package['version'].replace('+', '%2B')}"


def component(package, sums):
    of = {
        "type": "application" if package["name"] in PROGRAMS else "library",
        "bom-ref": purl(package),
        "name": package["name"],
        "version": package["version"],
        "scope": "required",
        "purl": purl(package),
    }
    if package["description"]:
        of["description"] = " ".join(package["description"].split())
    if package["authors"]:
        of["author"] = ", ".join(package["authors"])
    if expression(package):
        of["licenses"] = [{"expression": expression(package)}]
    if sum_of := sums.get((package["name"], package["version"])):
        of["hashes"] = [{"alg": "SHA-256", "content": sum_of}]
    repository = package["repository"] or ""
    if repository.startswith("https://") and "example.invalid" not in repository:
        of["externalReferences"] = [{"type": "vcs", "url": repository}]
    return of


def bill(target):
    packages, needs = linked(target)
    by_id = {package["id"]: package for package in packages}
    sums = checksums()
    version = next(p["version"] for p in packages if p["name"] == PROGRAMS[0])
    whole = {
        "type": "application",
        "bom-ref": f"softgrasp@{version}",
        "name": "softgrasp",
        "version": version,
        "licenses": [{"expression": "MIT OR Apache-2.0"}],
        "properties": [{"name": "softgrasp:target", "value": target}],
    }
    of_programs = [purl(p) for p in packages if p["name"] in PROGRAMS]
    dependencies = [{"ref": whole["bom-ref"], "dependsOn": of_programs}]
    for package in packages:
        refs = sorted(purl(by_id[name]) for name in needs[package["id"]])
        dependencies.append({"ref": purl(package), "dependsOn": refs})
    components = [component(package, sums) for package in packages]
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH", "0")) or None
    now = datetime.datetime.now(datetime.UTC).timestamp()
    time = datetime.datetime.fromtimestamp(seconds or now, datetime.UTC)
    # The same content has the same number, whenever it is made.
    number = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps([whole, components], sort_keys=True))
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": f"urn:uuid:{number}",
        "version": 1,
        "metadata": {
            "timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "tools": {"components": [{"type": "application", "name": "packaging/sbom.py"}]},
            "component": whole,
        },
        "components": components,
        "dependencies": dependencies,
    }


def main():
    target, out = sys.argv[1:]
    made = bill(target)
    Path(out).write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n")
    print(f"{len(made['components'])} packages in {out}")


if __name__ == "__main__":
    main()
