"""What a board remembers: saved parameters, boot counter, reset cause; with the power cut at every cell of a write."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from boebot import resources
from boebot.link import messages
from boebot_hil.rig import CYCLES_PER_S
from sim_bridge.bench.bench import bare
from sim_bridge.boards.board import Damage
from sim_bridge.tests.boards.avr.bootloader import KITS
from sim_bridge.tests.boards.symbols import DATA_BASE, entry_of
from sim_bridge.tests.rigs import SessionRig
from tools.tests.avr_program import IMAGES

pytestmark = pytest.mark.unsanitized

CYCLES_PER_MS = CYCLES_PER_S // 1000
CELL_S = 0.0034  # a write
SAVED_BYTES = 6 + 2 * len(messages.PARAMETERS)  # of one copy; firmware/src/storage.h
WRITE_S = 0.005  # from one cell to the next: every other slot
STEPS_S = 0.050  # between the steps of a record
COPIES = (128, 384)
BOOT_RING = range(256, 384)
BANDGAP, TRACK_WIDTH, LEFT_CENTRE, RIGHT_GAIN = 17, 12, 2, 5
VALUES = ({BANDGAP: 1050, TRACK_WIDTH: 10_001, LEFT_CENTRE: 22_500, RIGHT_GAIN: -3100},
          {BANDGAP: 1180, TRACK_WIDTH: 43_210, LEFT_CENTRE: 25_599, RIGHT_GAIN: 1234})  # fmt: skip


OK, SUPPLY_LOW = messages.AnswerStatus.OK, messages.AnswerStatus.SUPPLY_LOW


@pytest.fixture
def host(board_url: str) -> Iterator[SessionRig]:
    with SessionRig.open(board_url, robot=bare("shieldbot")) as rig:
        yield rig


def run(host: SessionRig, cycles: int) -> None:
    """Lets time pass in which the host says nothing."""
    host.session.sim.run(cycles)


def choose(host: SessionRig, values: dict[int, int]) -> None:
    for parameter, value in values.items():
        assert host.request(messages.SetParameter, parameter, value).status == OK


def in_force(host: SessionRig) -> dict[int, int]:
    return {parameter: host.request(messages.GetParameter, parameter).value for parameter in VALUES[0]}


def restart(host: SessionRig, cause: str) -> messages.Hello:
    """Resets the board and opens a session with it; returns what it says of itself."""
    host.board.reset(cause)
    return host.open_session()


@pytest.mark.soak_on_avr
@pytest.mark.parametrize("damage", list(Damage))
def test_power_cut_at_every_cell_of_a_save(host: SessionRig, damage: Damage) -> None:
    """Cuts 3 ms apart meet each write of 3.4 ms; after each one the values are all old or all new."""
    host.board.eeprom_damage(damage, garbage=0x33)
    host.open_session()
    choose(host, VALUES[0])
    assert host.request(messages.SaveParameters, within_s=1.0).status == OK
    now = 0
    hit: set[int] = set()
    outcomes = []
    for cut in range(round((SAVED_BYTES * WRITE_S + STEPS_S) / 0.003)):
        choose(host, VALUES[1 - now])
        before = host.board.read_eeprom()
        host.send(host.numbered(messages.SaveParameters))
        host.listen(cut * 0.003)
        written = host.board.read_eeprom()
        host.board.reset("power")
        run(host, 100)
        after = host.board.read_eeprom()
        hit |= {i for i in range(len(after)) if after[i] != written[i]}
        assert host.open_session().parameters_saved == 1
        found = in_force(host)
        assert found in VALUES, f"after a cut {cut * 3} ms into a save: neither old nor new, {found}"
        outcomes.append(found == VALUES[1 - now])
        now = VALUES.index(found)
        touched = {at for at in COPIES if before[at : at + 128] != after[at : at + 128]}
        assert len(touched) <= 1, "a save touched the copy that is in force"
        assert before[:128] == after[:128], "the first cells, which suffer when the supply fails, are left alone"
    assert True in outcomes
    assert False in outcomes
    if damage is Damage.GARBAGE:
        spared = [{i - at for i in hit if at <= i < at + SAVED_BYTES} for at in COPIES]
        assert len(spared[0] | spared[1]) >= SAVED_BYTES - 2, "the cuts did not meet every cell"


@pytest.mark.soak_on_avr
def test_power_cut_in_the_boot_counter(host: SessionRig) -> None:
    """Started again and again, cut in mid-write: it goes up by one or stays, and never anything else."""
    host.board.eeprom_damage(Damage.GARBAGE, garbage=0xA5)
    counter = host.next_hello().boot_counter
    assert counter == 1
    went_up = 0
    for cut in range(18):
        run(host, 9_700 * CYCLES_PER_MS)
        before = host.board.read_eeprom()
        for _ in range(600):
            if host.board.read_eeprom() != before:
                break
            run(host, CYCLES_PER_MS)
        else:
            raise AssertionError("the start was not counted after 10 s")
        run(host, 3 * cut * CYCLES_PER_MS)  # the first cell is written: into each of the others, and beyond
        host.board.reset("power")
        run(host, 100)
        assert {i for i, cell in enumerate(host.board.read_eeprom()) if cell != before[i]} <= set(BOOT_RING)
        host.heard.clear()
        found = host.next_hello().boot_counter
        assert found in (counter, counter + 1)
        went_up += found - counter
        counter = found
    assert 1 <= went_up <= 9
    for _ in range(2):
        run(host, 10_300 * CYCLES_PER_MS)
        host.board.reset("external")
        host.heard.clear()
        counter += 1
        assert host.next_hello().boot_counter == counter


def test_nothing_is_written_while_the_supply_is_low(host: SessionRig) -> None:
    host.open_session()
    choose(host, VALUES[0])
    assert host.request(messages.SaveParameters, within_s=1.0).status == OK
    choose(host, VALUES[1])
    request = host.numbered(messages.SaveParameters)
    host.send(request)
    host.listen(0.05)
    host.board.supply(3.9)
    answer = host.first(messages.Answer, lambda answer: answer.number == request.number, 0.1, "the end of the save")
    assert answer.status == SUPPLY_LOW
    host.listen(0.01)  # the cell under way
    before = host.board.read_eeprom()
    assert host.request(messages.SaveParameters, within_s=1.0).status == SUPPLY_LOW
    host.listen(0.3)
    assert host.board.read_eeprom() == before
    host.board.supply(5.0)
    restart(host, "power")
    assert in_force(host) == VALUES[0]


# ---- resets ----------------------------------------------------------------------------------------------------------


def test_nonce_is_another_one_after_each_reset(host: SessionRig) -> None:
    nonces = [host.next_hello().board_nonce]
    for i in range(40):
        host.board.reset("external" if i % 2 else "watchdog")
        nonces.append(host.next_hello().board_nonce)
    assert len(set(nonces)) == len(nonces)
    assert all(0 < nonce < 1 << 21 for nonce in nonces)


JUMP_TO_ITSELF, CLI = b"\xff\xcf", b"\xf8\x94"


def patched(folder: Path, function: str, code: bytes) -> Path:
    """A copy of the image in which a function begins with other code."""
    image = resources.folder("images") / "shieldbot.elf"
    elf = ELFFile(io.BytesIO(image.read_bytes()))
    text = elf.get_section_by_name(".text")
    assert text is not None
    start = text["sh_offset"] + entry_of(image, function) - text["sh_addr"]
    path = folder / "patched.elf"
    changed = bytearray(image.read_bytes())
    changed[start : start + len(code)] = code
    path.write_bytes(changed)
    return path


HANGS, HANGS_DEAF = JUMP_TO_ITSELF, CLI + JUMP_TO_ITSELF
HANG_AT = "identity_send"  # what answers `identify`
WATCHDOG, EXTERNAL, POWER = messages.ResetCause.WATCHDOG, messages.ResetCause.EXTERNAL, messages.ResetCause.POWER


@pytest.mark.parametrize(
    ("code", "bootloader", "reported", "reset_s"),
    [
        (HANGS, False, WATCHDOG, 0.141),
        (HANGS_DEAF, False, WATCHDOG, 0.250),
        (HANGS, True, WATCHDOG, 0.141),
        (HANGS_DEAF, True, EXTERNAL, 0.250),
    ],
    ids=["hangs", "hangs with interrupts off", "hangs behind a bootloader", "with interrupts off behind a bootloader"],
)
def test_a_hang_is_told(
    tmp_path: Path, code: bytes, bootloader: bool, reported: messages.ResetCause, reset_s: float
) -> None:
    """The watchdog warns after 125 ms and resets 16 ms later, or another 125 ms later if nobody heard it; then nobody
    marks the record, either, by which a program behind a bootloader knows it."""
    image = patched(tmp_path, HANG_AT, code)
    loader = str(KITS) if bootloader else None
    host = SessionRig.open("avr", robot=bare("shieldbot"), image=str(image), bootloader=loader)
    host.next_hello()
    host.send(messages.Identify())
    host.listen(reset_s - 0.003)
    assert host.board.counters()["resets"] == 0
    cause = messages.ResetCause(host.next_hello().reset_cause)
    assert cause.name.partition("_IN_")[0] == reported.name  # it may say in which task
    assert host.board.counters()["resets"] == 1
    host.board.reset("external")
    assert host.next_hello(2.0).reset_cause == EXTERNAL


@pytest.mark.parametrize("pin_map", IMAGES)
def test_behind_a_bootloader_the_memory_tells_the_cause(pin_map: str) -> None:
    """It leaves nothing of the chip's own answer. RAM holds something else whenever the power comes; a brown-out that
    leaves it whole looks like an external reset."""
    host = SessionRig.open("avr", robot=bare(pin_map), bootloader=str(KITS))
    assert host.next_hello().reset_cause == POWER
    for cause, reported in [
        ("external", EXTERNAL),
        ("external", EXTERNAL),
        ("power", POWER),
        ("brown_out", EXTERNAL),
        ("power", POWER),
        ("power", POWER),
    ]:
        host.board.reset(cause)
        assert host.next_hello(2.0).reset_cause == reported


@pytest.mark.parametrize("pin_map", IMAGES)
def test_what_a_reset_leaves_alone_lies_where_no_bootloader_writes(pin_map: str) -> None:
    """Optiboot's buffer is 0x100 to 0x1FF, its stack at the end of RAM (0x8FF)."""
    elf = ELFFile(io.BytesIO((resources.folder("images") / f"{pin_map}.elf").read_bytes()))
    noinit = elf.get_section_by_name(".noinit")
    assert noinit is not None and noinit["sh_size"] >= 32
    begin = noinit["sh_addr"] - DATA_BASE
    assert begin >= 0x200
    assert begin + noinit["sh_size"] <= 0x900 - 64


# ---- layout ----------------------------------------------------------------------------------------------------------


def crc16(data: bytes) -> int:
    """CRC-16/MCRF4XX: polynomial 0x1021, reflected, from 0xFFFF."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def test_parameters_of_an_older_layout_are_forgotten_and_the_starts_go_on(host: SessionRig) -> None:
    """Up to now a record began at address 0 and one at 128; the ring of the boot counter has its old place."""
    values = b"".join((1000 + i).to_bytes(2, "little") for i in range(24))
    content = b"\x05\x34\x12" + values
    record = b"\xa5" + content + crc16(content).to_bytes(2, "little")
    boots = b"\x00" + (41).to_bytes(4, "little")
    entry = b"\xa5" + boots + crc16(boots).to_bytes(2, "little")
    for address, data in ((0, record), (128, record), (256, entry)):
        host.board.write_eeprom(address, data)
    hello = host.open_session()
    assert (hello.parameters_saved, hello.boot_counter) == (0, 42)
    choose(host, VALUES[0])
    assert host.request(messages.SaveParameters, within_s=1.0).status == OK
    assert restart(host, "power").parameters_saved == 1
    assert in_force(host) == VALUES[0]
    assert host.board.read_eeprom()[: len(record)] == record


def test_what_becomes_of_the_first_cell_does_not_matter(host: SessionRig) -> None:
    """When the supply fails it is address 0 that is written (data sheet, 8.4.2)."""
    host.open_session()
    choose(host, VALUES[0])
    assert host.request(messages.SaveParameters, within_s=1.0).status == OK
    for byte in (0x00, 0xA5, 0xFF):
        host.board.write_eeprom(0, [byte])
        assert restart(host, "power").parameters_saved == 1
        assert in_force(host) == VALUES[0]
