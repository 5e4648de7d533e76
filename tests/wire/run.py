"""Runs the Python blocks of docs/wire.md, as one program, against a server of its own.

    python3 tests/wire/run.py SERVER_PROGRAM PAGE
"""

import re
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

# Seconds after which the program or the server hangs; far more than a busy machine takes.
HANGS = 120
# The last words of the program, so that one that ends early does not pass.
LAST_LINE = "all as expected"


def blocks(page, language):
    """The code of all fenced blocks in a language."""
    found = re.findall(rf"^```{language}\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    if not found:
        sys.exit(f"wire: FAILED: the page has no block in {language}")
    return found


def bytes_of(block):
    """The bytes of a block in hexadecimal whose lines may end in a note."""
    return bytes.fromhex(" ".join(line.split(";")[0] for line in block.splitlines()))


def check_methods(page, scope):
    """A method that is not there is refused with the names of all that are: those of the page."""
    listed = re.findall(r"^\| `([a-z-]+)` \|", page.split("| Method |")[1].split("\n\n")[0], re.M)
    session, model = scope["session"], bytes(scope["session_model"])
    payload = scope["frame_payload"](model, scope["known"], method="nobody")
    try:
        session.ask(scope["FRAME"], payload, scope["ANSWER"])
    except scope["Rejected"] as rejected:
        assert rejected.code == 7, rejected
        told = re.search(r"there are (.*)$", rejected.text).group(1)
        told = re.split(r", | and ", told)
        assert sorted(told) == sorted(listed), f"the server knows {told}, the page {listed}"
        return
    raise AssertionError("a method that is not there was taken")


def check_decoder(page, scope):
    """The page's decoder reads the page's example of an answer."""
    frame = bytes_of(blocks(page, "hex")[-1])
    answer = scope["read_answer"](scope["Reader"](frame[32:]))
    assert [node for node, _ in answer["displacements"]] == [0, 2, 3], answer
    assert answer["displacements"][0][1] == (0.0, -0.001, 0.0005), answer
    assert answer["reactions"] == {2: -1.25}, answer
    assert answer["mask_forces"] == [(0.0, -0.75, 0.125), (0.5, 0.0, 0.0)], answer
    assert answer["report"]["warning_level"] == "caution", answer
    assert answer["report"]["warnings"] == ["large rotation", ""], answer


def check_beyond(page, address):
    """What the page says and its program does not show; run with the page's own functions."""
    scope = {"__name__": "page"}
    socket.setdefaulttimeout(HANGS)
    sys.argv = ["page", address]
    *definitions, conversation = blocks(page, "python")
    exec(compile("\n".join(definitions), "docs/wire.md", "exec"), scope)
    check_decoder(page, scope)
    # The conversation up to its upload: a session that holds the model.
    start = conversation.split("# Pull the face")[0]
    exec(compile(start, "docs/wire.md, conversation", "exec"), scope)
    scope["session_model"] = scope["model"]
    scope["known"] = [(3 * node, 0.001) for node in scope["right"]]
    check_methods(page, scope)
    check_zero_answer(scope)
    check_empty_question(scope)
    check_shared_model(scope)
    check_last_words(scope)


def check_zero_answer(scope):
    """Where nothing moves the scale is 0, and a fixed degree of freedom may be named again."""
    known = [(dof, 0.0) for dof, _ in scope["known"]] + [(scope["fixed"][0], 0.0)]
    payload = scope["frame_payload"](scope["model"], known, quantised=True, reactions=True)
    reader = scope["session"].ask(scope["FRAME"], payload, scope["ANSWER"])
    answer = scope["read_answer"](reader)
    assert all(u == (0.0, 0.0, 0.0) for _, u in answer["displacements"]), answer
    expected = sorted({dof for dof, _ in known} | set(scope["fixed"]))
    assert list(answer["reactions"]) == expected, answer


def check_empty_question(scope):
    """A frame that gives no displacement is answered where the fixed nodes hold the body."""
    payload = scope["frame_payload"](scope["model"], [], quantised=True)
    reader = scope["session"].ask(scope["FRAME"], payload, scope["ANSWER"])
    answer = scope["read_answer"](reader)
    assert all(u == (0.0, 0.0, 0.0) for _, u in answer["displacements"]), answer


def check_shared_model(scope):
    """A second upload finds the model; what another session holds is not forgotten by Drop."""
    first, model = scope["session"], scope["model"]
    second = scope["Session"](first.stream.getpeername(), "a second client")
    upload = scope["upload_payload"](
        scope["vertices"], scope["tets"], scope["YOUNG"], scope["POISSON"], scope["fixed"][::-1])
    ready = second.ask(scope["UPLOAD_MODEL"], upload, scope["MODEL_READY"])
    assert (ready.read("32s"), ready.read("QQ?")[2]) == (model, True)
    frame = scope["frame_payload"](model, scope["known"], nodes=[0])
    second.send(scope["DROP"], model)
    # The second session has no hold any more; Ping first, so that its Drop has been seen.
    second.ask(scope["PING"], bytes(8), scope["PONG"])
    scope["read_answer"](first.ask(scope["FRAME"], frame, scope["ANSWER"]))


def check_last_words(scope):
    """Bytes that are no frame are answered with one Rejected of id 0, and an end."""
    session = scope["Session"](scope["session"].stream.getpeername(), "a broken client")
    damaged = bytearray(scope["frame"](scope["PING"], 9, bytes(8)))
    damaged[-1] ^= 1
    session.stream.sendall(damaged)
    kind, request_id, payload = scope["read_frame"](session.stream)
    assert (kind, request_id) == (scope["REJECTED"], 0)
    assert scope["Rejected"](payload).code == 1
    assert session.stream.recv(1) == b""


def main():
    program, page = sys.argv[1], Path(sys.argv[2]).read_text(encoding="utf-8")
    code = "\n".join(blocks(page, "python"))
    server = subprocess.Popen(
        [program, "--listen", "127.0.0.1:0", "--threads", "2"],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        address = server.stdout.readline().split("listening on ")[-1].strip()
        with tempfile.TemporaryDirectory() as folder:
            client = Path(folder) / "client.py"
            client.write_text(code, encoding="utf-8")
            # Isolated and without site packages: the standard library is all there is.
            ran = subprocess.run(
                [sys.executable, "-I", "-S", str(client), address],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, timeout=HANGS)
        print(ran.stdout, end="")
        if ran.returncode != 0 or ran.stdout.splitlines()[-1:] != [LAST_LINE]:
            sys.exit(f"wire: FAILED: the program of the page ended with {ran.returncode}")
        check_beyond(page, address)
    finally:
        server.terminate()
        server.wait(timeout=HANGS)


main()
