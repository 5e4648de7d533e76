"""The programs in the documents run as they stand there."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import PROGRAM, ROOT

DOCUMENTS = ["clients/python/README.md", "docs/python.md", "docs/start.md"]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_program_of_a_document_runs(name: str, tmp_path: Path) -> None:
    """All blocks of a document in Python are one program, one behind the other."""
    page = ROOT / name
    if not page.exists():
        pytest.skip(f"{name} is not there")
    blocks = re.findall(
        r"^```python\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    assert blocks
    (tmp_path / "page.py").write_text("\n".join(blocks), "utf-8")
    environment = dict(os.environ)
    if PROGRAM is not None:
        folder = str(Path(PROGRAM).resolve().parent)
        environment["PATH"] = folder + os.pathsep + environment["PATH"]
    ran = subprocess.run(
        [sys.executable, "page.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout


def test_example_of_the_readme_has_ten_lines() -> None:
    text = (ROOT / DOCUMENTS[0]).read_text("utf-8")
    block = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert block is not None
    assert len([line for line in block[1].splitlines() if line.strip()]) <= 10
