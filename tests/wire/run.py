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
    payload = scope["ask_payload"](scope["model"], scope["known"], method="nobody")
    rejected = refusal(scope, scope["ASK"], payload)
    assert rejected.code == 7, rejected
    told = re.search(r"there are (.*)$", rejected.text).group(1)
    told = re.split(r", | and ", told)
    assert sorted(told) == sorted(listed), f"the server knows {told}, the page {listed}"


def refusal(scope, kind, payload):
    """The refusal of a request."""
    try:
        scope["session"].ask(kind, payload, scope["ANSWER"])
    except scope["Rejected"] as rejected:
        return rejected
    raise AssertionError("a request was taken that cannot be granted")


def check_decoder(page, scope):
    """The page's decoder reads the page's examples of answers, and longer ones of a later server."""
    *_, large, answer = [bytes_of(block)[32:] for block in blocks(page, "hex")]
    read = lambda payload: scope["read_answer"](scope["Payload"](payload))
    answer = read(answer)
    assert [node for node, _ in answer["displacements"]] == [0, 2, 3], answer
    assert answer["displacements"][0][1] == (0.0, -0.001, 0.0005), answer
    assert answer["reactions"] == {2: -1.25}, answer
    assert answer["mask_forces"] == [(0.0, -0.75, 0.125), (0.5, 0.0, 0.0)], answer
    assert answer["report"]["warning_level"] == "caution", answer
    assert answer["report"]["warnings"] == [(1, "large rotation"), (0, "")], answer
    length = int.from_bytes(large[:8], "little")
    arrays = large[8 + length + -(8 + length) % 8:]
    longer = scope["payload_of"](large[8:8 + length] + b"more fields", arrays)
    assert read(large) == read(longer) and read(large)["displacements"][0][0] == 1


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
    scope["known"] = [(3 * node, 0.001) for node in scope["right"]]
    check_methods(page, scope)
    check_zero_answer(scope)
    check_empty_question(scope)
    check_capabilities(page, scope)
    check_longer_request(scope)
    check_one_reply_each(scope)
    check_shared_model(scope)
    check_alive(scope)
    check_versions(scope)
    check_last_words(scope)


def check_zero_answer(scope):
    """Where nothing moves the scale is 0, and a fixed degree of freedom may be named again."""
    known = [(dof, 0.0) for dof, _ in scope["known"]] + [(scope["fixed"][0], 0.0)]
    payload = scope["ask_payload"](scope["model"], known, quantised=True, reactions=True)
    answer = scope["read_answer"](scope["session"].ask(scope["ASK"], payload, scope["ANSWER"]))
    assert all(u == (0.0, 0.0, 0.0) for _, u in answer["displacements"]), answer
    expected = sorted({dof for dof, _ in known} | set(scope["fixed"]))
    assert list(answer["reactions"]) == expected, answer


def check_empty_question(scope):
    """A question that gives no displacement is answered where the fixed nodes hold the body."""
    payload = scope["ask_payload"](scope["model"], [], quantised=True)
    answer = scope["read_answer"](scope["session"].ask(scope["ASK"], payload, scope["ANSWER"]))
    assert all(u == (0.0, 0.0, 0.0) for _, u in answer["displacements"]), answer


def check_capabilities(page, scope):
    """The page names what the server says that it can do."""
    told = scope["session"].capabilities
    assert told and all(f"`{name}`" in page for name in told), told


def check_longer_request(scope):
    """The server passes over fields that it does not know."""
    payload = scope["payload_of"](scope["struct"].pack("<Q", 5) + b"of a later client")
    session = scope["session"]
    session.send(scope["PING"], payload)
    kind, request_id, reply = session.receive()
    assert (kind, request_id) == (scope["PONG"], session.request_id)
    assert scope["Payload"](reply).part.read("Q") == 5


def check_one_reply_each(scope):
    """Of requests that are superseded or cancelled each gets one reply, in order; the rest goes on."""
    session, sent = scope["session"], []
    for _ in range(4):
        session.send(scope["ASK"], scope["ask_payload"](
            scope["model"], scope["known"], newest_wins=True, report=2))
        sent.append(session.request_id)
    session.send(scope["CANCEL"], scope["payload_of"](scope["struct"].pack("<Q", sent[1])))
    session.send(scope["CANCEL"], scope["payload_of"](scope["struct"].pack("<Q", 10**6)))
    for position, request_id in enumerate(sent):
        kind, replied, payload = session.receive()
        assert replied == request_id, (replied, sent)
        if kind != scope["ANSWER"]:
            code = scope["Rejected"](payload).code
            assert code in (15, 16) and position < len(sent) - 1, (code, position)
    session.ask(scope["PING"], scope["payload_of"](bytes(8)), scope["PONG"])


def check_shared_model(scope):
    """A second upload finds the model; what another session holds is not forgotten by Drop."""
    first, model = scope["session"], scope["model"]
    second = scope["Session"](first.stream.getpeername(), "a second client")
    # A model that it does not hold stays.
    second.send(scope["DROP"], scope["payload_of"](model))
    second.ask(scope["PING"], scope["payload_of"](bytes(8)), scope["PONG"])
    upload = scope["upload_payload"](
        scope["vertices"], scope["tets"], scope["YOUNG"], scope["POISSON"], scope["fixed"][::-1])
    ready = second.ask(scope["UPLOAD_MODEL"], upload, scope["MODEL_READY"]).part
    assert (ready.read("32s"), ready.read("QQ?")[2]) == (model, True)
    question = scope["ask_payload"](model, scope["known"], nodes=[0])
    second.send(scope["DROP"], scope["payload_of"](model))
    # The second session has no hold any more; Ping first, so that its Drop has been seen.
    second.ask(scope["PING"], scope["payload_of"](bytes(8)), scope["PONG"])
    scope["read_answer"](first.ask(scope["ASK"], question, scope["ANSWER"]))


def check_alive(scope):
    """A server that was asked to says that it is there, unasked and with id 0."""
    address = scope["session"].stream.getpeername()
    session = scope["Session"](address, "a waiting client", alive_every_ms=100)
    kind, request_id, payload = scope["read_frame"](session.stream)
    assert (kind, request_id, payload) == (scope["ALIVE"], 0, bytes(8))
    session.ask(scope["PING"], scope["payload_of"](bytes(8)), scope["PONG"])


def check_versions(scope):
    """No common version is refused in words; an older header in the form of its version."""
    pack, address = scope["struct"].pack, scope["session"].stream.getpeername()
    with socket.create_connection(address) as stream:
        hello = scope["text"]("a client to come") + b"\0" + pack("<HH", 1000, 1001)
        stream.sendall(scope["frame"](scope["HELLO"], 1, scope["payload_of"](hello)))
        kind, request_id, payload = scope["read_frame"](stream)
        rejected = scope["Rejected"](payload)
        assert (kind, request_id, rejected.code) == (scope["REJECTED"], 1, 13), rejected
        assert "1000" in rejected.text and str(scope["VERSION"]) in rejected.text, rejected
    for version in (1, 2, 3):
        head = pack("<4sHHIIQ", b"SGRP", version, scope["PING"], 0, 8, 1)
        head += pack("<I", scope["crc32c"](head))
        head += pack("<I", scope["crc32c"](bytes(8), scope["crc32c"](head)))
        with socket.create_connection(address) as stream:
            stream.sendall(head + bytes(8))
            head = scope["read_exactly"](stream, 32)
            assert int.from_bytes(head[4:6], "little") == version, head
            payload = scope["read_exactly"](stream, int.from_bytes(head[12:16], "little"))
            fields = scope["Fields"](payload)
            assert fields.read("H") == 13 and str(version) in fields.text(), payload
            assert stream.recv(1) == b""


def check_last_words(scope):
    """Bytes that are no frame are answered with one Rejected of id 0, and an end."""
    session = scope["Session"](scope["session"].stream.getpeername(), "a broken client")
    damaged = bytearray(scope["frame"](scope["PING"], 9, scope["payload_of"](bytes(8))))
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
