"""The native hardware layer by itself: EEPROM, memory that outlives a reset, supply, bit rate."""

from __future__ import annotations

import pytest

from boebot.errors import BoardError
from sim_bridge.boards.board import Damage, ResetCause
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.native.native_program import native_program

MS = 16_000  # cycles
BYTE = 320
WRITE = 54_400  # 3.4 ms: data sheet of the ATmega328P, table 8-1


def said(board: BoardAccess) -> bytes:
    """What the program said since the last call."""
    return bytes(byte for _, byte in board.receive())


# ---- EEPROM ----

# Writes one byte, and says at each slot whether it is still busy.
WRITER = """
static void start(void) {
  slot();
  hal_eeprom_write_start(9, 0x55); /* after a reset without effect, as the next */
  hal_eeprom_write_start(9, 0x66);
}
static void slot(void) { say(hal_eeprom_busy() ? "b" : "-", 1); }
"""


def test_fresh_board_is_erased() -> None:
    assert native_program(WRITER).read_eeprom() == b"\xff" * 1024


def test_a_write_takes_3_4_ms() -> None:
    board = native_program(WRITER)
    board.advance(WRITE - 1)
    assert board.read_eeprom() == b"\xff" * 1024
    board.advance(WRITE)
    assert board.read_eeprom() == b"\xff" * 9 + b"\x55" + b"\xff" * 1014
    board.advance(9 * MS)
    assert said(board) == b"-b--"  # slots at 2.5, 5 and 7.5 ms


def test_a_run_does_not_depend_on_how_it_is_cut() -> None:
    whole, cut = native_program(WRITER), native_program(WRITER)
    whole.advance(10 * MS)
    while cut.now < 10 * MS:
        cut.run(min(1009, 10 * MS - cut.now))
    assert cut.receive() == whole.receive()


@pytest.mark.parametrize("cause", [ResetCause.EXTERNAL, ResetCause.WATCHDOG])
def test_a_write_outlives_a_reset_that_keeps_the_supply(cause: ResetCause) -> None:
    board = native_program(WRITER)
    board.advance(MS)
    board.reset(cause)
    board.advance(WRITE - 1)
    assert board.read_eeprom()[9] == 0xFF
    board.advance(WRITE)
    assert board.read_eeprom()[9] == 0x55
    board.advance(7 * MS)
    assert said(board) == b"-b--"


@pytest.mark.parametrize("cause", [ResetCause.POWER, ResetCause.BROWN_OUT])
@pytest.mark.parametrize(
    ("damage", "left"),
    [(None, 0xFF), (Damage.ERASED, 0xFF), (Damage.OLD, 0x0F), (Damage.NEW, 0x55), (Damage.GARBAGE, 0xC3)],
)
def test_loss_of_supply_damages_the_cell_under_way(cause: ResetCause, damage: Damage | None, left: int) -> None:
    board = native_program(
        """
        static void start(void) { if (hal_eeprom_read(0) != 0) hal_eeprom_write_start(9, 0x55); }
        static void slot(void) {}
        """
    )
    board.write_eeprom(8, [1, 0x0F, 2])
    if damage is not None:
        board.eeprom_damage(damage, garbage=0xC3)
    board.advance(3 * MS)
    board.write_eeprom(0, [0])  # the next start writes nothing
    board.reset(cause)
    board.advance(20 * MS)
    assert board.read_eeprom()[8:11] == bytes([1, left, 2])


def test_no_data_memory() -> None:
    board = native_program(WRITER)
    with pytest.raises(BoardError, match="no data memory to look into"):
        board.read_memory(0x100, 1)
    with pytest.raises(BoardError, match="no data memory to look into"):
        board.write_memory(0x100, b"a")


# ---- memory that no start clears ----

KEEPER = """
static void start(void) {
  uint8_t *kept = hal_noinit();
  say(kept, HAL_NOINIT_SIZE);
  for (uint8_t i = 0; i < HAL_NOINIT_SIZE; i++) kept[i] = i;
}
static void slot(void) {}
"""


@pytest.mark.parametrize("cause", list(ResetCause))
def test_memory_outlives_a_reset_but_not_the_loss_of_supply(cause: ResetCause) -> None:
    board = native_program(KEEPER)
    board.advance(2 * MS)
    first = said(board)
    assert len(first) == 32
    assert len(set(first)) > 16, "not zeros: anything"
    board.reset(cause)
    board.advance(4 * MS)
    assert said(board) == (first if cause == ResetCause.POWER else bytes(range(32)))


# ---- supply ----

METER = """
static void report(void) {
  const uint16_t result = hal_analog_result();
  const uint8_t bytes[2] = {(uint8_t)result, (uint8_t)(result >> 8)};
  say(bytes, 2);
}
static void start(void) { report(); hal_analog_select(HAL_ANALOG_BANDGAP); hal_analog_convert(); }
static void slot(void) { report(); hal_analog_convert(); report(); }
"""


def results(board: BoardAccess) -> list[int]:
    data = said(board)
    return [int.from_bytes(data[i : i + 2], "little") for i in range(0, len(data), 2)]


@pytest.mark.parametrize(("volts", "result"), [(None, 225), (5.0, 225), (4.5, 250), (3.3, 341), (1.0, 1023)])
def test_supply_is_measured_against_the_band_gap(volts: float | None, result: int) -> None:
    # 1.1 V * 1024 / volts: 225.28, 250.3, 341.3, more than ten bits hold
    board = native_program(METER)
    if volts is not None:
        board.supply(volts)
    board.advance(3 * MS)
    assert results(board) == [0, result, result]


def test_a_measurement_takes_104_us() -> None:
    board = native_program(METER)
    board.advance(1663)
    board.supply(4.5)
    board.advance(1664)
    board.supply(3.3)
    board.advance(3 * MS)
    assert results(board) == [0, 250, 250]


# ---- bit rate ----

# Says "Hello" at each slot, at a rate that the test writes into the EEPROM (units of 100 baud); stores what it hears.
TALKER = """
static uint16_t count;
static void start(void) {
  const uint16_t rate = (uint16_t)(hal_eeprom_read(0) | hal_eeprom_read(1) << 8);
  if (rate != 0xFFFF) hal_start_serial(rate);
}
static void slot(void) {
  uint8_t byte;
  while (hal_serial_receive(&byte)) { say(&byte, 1); count++; }
  say("Hello", 5);
}
"""


def talker(board_baud: int, line_baud: int) -> BoardAccess:
    board = native_program(TALKER)
    board.write_eeprom(0, (board_baud // 100).to_bytes(2, "little"))
    board.line_rate(line_baud)
    return board


@pytest.mark.parametrize("baud", [57_600, 115_200, 250_000, 500_000, 1_000_000])
def test_both_sides_at_the_same_rate(baud: int) -> None:
    board = talker(baud, baud)
    board.send(b"abc", at=100)
    board.advance(5 * MS)
    heard = board.receive()
    assert bytes(byte for _, byte in heard) == b"abcHello"
    assert [cycle - 40_000 for cycle, _ in heard] == [(i + 1) * (160_000_000 // baud) for i in range(8)]
    assert board.counters()["framing_errors"] == 0
    assert board.counters()["bytes_in"] == 3


@pytest.mark.parametrize(("board_baud", "line_baud"), [(500_000, 115_200), (115_200, 500_000), (500_000, 522_000)])
def test_another_rate_is_garbage_in_both_directions(board_baud: int, line_baud: int) -> None:
    board = talker(board_baud, line_baud)
    board.send(b"abc", at=100)
    board.advance(6 * MS)
    heard = said(board)
    assert len(heard) >= 8
    assert not set(heard[3:8]) & set(b"Hello")
    assert not set(heard) & set(b"abc")
    assert board.counters()["framing_errors"] == board.counters()["bytes_in"] == 3


@pytest.mark.parametrize("line_baud", [485_000, 515_000])
def test_rates_within_tolerance_are_understood(line_baud: int) -> None:
    board = talker(500_000, line_baud)
    board.send(b"abc", at=100)
    board.advance(4 * MS)
    assert said(board) == b"abcHello"


def test_bytes_that_have_arrived_stay_as_they_were_read() -> None:
    board = talker(500_000, 500_000)
    board.advance(3 * MS)
    board.line_rate(115_200)
    assert said(board) == b"Hello"
    board.run(3 * MS)
    assert said(board) != b"Hello"


def test_rate_is_the_default_again_after_a_reset() -> None:
    board = talker(115_200, 500_000)
    board.advance(3 * MS)
    board.receive()
    board.write_eeprom(0, b"\xff\xff")
    board.reset()
    board.run(3 * MS)
    assert said(board) == b"Hello"
