"""Server and package may learn fields, warnings and refusals without each other."""

import numpy as np
import pytest
from golden import golden, golden_reader, part_of, reader_of, with_part

from softgrasp import BadStream, Refused, WarningCode, calls
from softgrasp.answer import read_answer, read_large_answer, read_several_answers
from softgrasp.contact import read_contact_answer
from softgrasp.conversation import Conversation
from softgrasp.fields import Fields, Part
from softgrasp.framing import HEADER_LEN, Header, Kind
from softgrasp.limits import Limits
from softgrasp.payload import PayloadReader, payload_of
from softgrasp.report import read_large_report, read_solve_report

READS = {
    "Welcome": calls.hello("a test", None).read,
    "Answer": read_answer,
    "Answer-large": read_large_answer,
    "Answer-cases": read_several_answers,
    "ModelState": calls.have_model(bytes(32)).read,
    "Pong": calls.ping(0x0123456789ABCDEF).read,
    "ContactAnswer": lambda reader: read_contact_answer(reader, 4),
}


def shown(value: object) -> str:
    with np.printoptions(threshold=1_000):
        return repr(value)


@pytest.mark.parametrize("name", READS)
@pytest.mark.parametrize("more", [b"\7", b"\1" * 8, b"\xff" * 100])
def test_fields_of_a_later_version_are_passed_over(name: str, more: bytes) -> None:
    payload = golden(name)[HEADER_LEN:]
    longer = with_part(payload, part_of(payload) + more)
    assert shown(READS[name](reader_of(longer))) == shown(READS[name](golden_reader(name)))


def block(payload: bytes) -> tuple[bytes, bytes]:
    """The block that a part begins with, and what follows it."""
    part = part_of(payload)
    length = int.from_bytes(part[:8], "little")
    return part[8 : 8 + length], part[8 + length :]


@pytest.mark.parametrize("name", ["Answer", "Answer-large", "ContactAnswer"])
def test_structures_inside_a_part_may_grow(name: str) -> None:
    payload = golden(name)[HEADER_LEN:]
    fields, rest = block(payload)
    longer = (len(fields) + 5).to_bytes(8, "little") + fields + b"later" + rest
    expected = shown(READS[name](golden_reader(name)))
    assert shown(READS[name](reader_of(with_part(payload, longer)))) == expected


def test_missing_fields_of_an_earlier_version_are_zero() -> None:
    old = Part().text("old").text("0.1").fields("I", 3).block(Part().fields("II", 1000, 20))
    welcome = READS["Welcome"](reader_of(payload_of(old)))
    assert (welcome.server, welcome.threads, welcome.wire) == ("old", 3, 0)
    assert (welcome.capabilities, welcome.idle) == (frozenset(), None)
    assert (welcome.limits.node_count_max, welcome.limits.dof_count_max) == (20, 0)
    fields, _ = block(golden("Answer")[HEADER_LEN:])
    whole = read_solve_report(Fields(fields, Limits()))
    cut = fields[: fields.index(b"f64") + 3]
    report = read_solve_report(Fields(cut, Limits()))
    assert (report.method, report.max_strain, report.precision) == ("sparse", 0.0625, "f64")
    assert (report.error_estimate_rel, report.warnings, report.chosen_because) == (None, (), "")
    assert whole.error_estimate_rel == 1e-13 and report.is_told
    assert read_large_report(Fields(b"", Limits())).deformation == "large"
    with pytest.raises(BadStream, match="ends inside a text"):
        read_solve_report(Fields(fields[:10], Limits()))


def test_warning_that_is_not_known_keeps_its_number() -> None:
    fields, rest = block(golden("Answer")[HEADER_LEN:])
    known = (1).to_bytes(2, "little") + (14).to_bytes(8, "little") + b"large rotation"
    other = (4711).to_bytes(2, "little") + known[2:]
    assert fields.count(known) == 1
    changed = fields.replace(known, other)
    part = len(changed).to_bytes(8, "little") + changed + rest
    answer = read_answer(reader_of(with_part(golden("Answer")[HEADER_LEN:], part)))
    assert answer.report.warnings == ("large rotation", "")
    assert answer.report.warnings[0].code == 4711
    assert not isinstance(answer.report.warnings[0].code, WarningCode)


def test_refusal_that_is_not_known_keeps_its_number_however_short_it_is() -> None:
    payload = np.frombuffer(payload_of(Part().fields("H", 900)), dtype=np.uint8)
    header = Header(Kind.REJECTED, len(payload), 1, 0, 0)
    with pytest.raises(Refused, match="900") as caught:
        Conversation(Limits()).reply(calls.ping(), header, payload)
    assert type(caught.value) is Refused
    assert (caught.value.code, caught.value.text, caught.value.retry_after) == (900, "", None)


def test_levels_and_elements_of_a_later_version_are_read() -> None:
    part = Part().text("a method").fields("IQQ8d", 7, 1, 2, *[0.0] * 8)
    part.raw(b"\0\0").fields("Idd", 0, 0.0, 0.0).text("f16").raw(b"\0\0").fields("I", 9)
    report = read_solve_report(Fields(part.data(), Limits()))
    assert (report.element, report.warning_level) == ("element 7", "serious")


def test_list_that_is_announced_and_not_there_takes_no_memory() -> None:
    part = Part().text("s").text("0").fields("I", 1).block(Part()).fields("HQ", 4, 1 << 60)
    with pytest.raises(BadStream, match="texts are announced"):
        READS["Welcome"](reader_of(payload_of(part)))
    with pytest.raises(BadStream, match="ends before"):
        PayloadReader(np.zeros(4, np.uint8), Limits())
