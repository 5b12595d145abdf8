"""Interrupts: entry, return, wake-up from idle, and the one instruction that always runs before the next one.

Most are INT0 and INT1, which the program raises itself: pins 2 and 3 are outputs, and their edges count all the same
(data sheet, 13). Each vector holds a JMP, 3 cycles.
"""

from __future__ import annotations

from functools import partial

from tools.tests.calibration.rows import STAMP_CYCLES, Row

JMP = 3
RETI = 4
ENTRY = 4
RESPONSE = "7.7.1"
row = partial(Row, group="Interrupts")

# Raises both flags with interrupts off; one enable bit for each row that wants it.
RAISED = """
  sbi DDRD, 2
  sbi DDRD, 3
  cbi PORTD, 2
  cbi PORTD, 3
  store EICRA, 1 << ISC01 | 1 << ISC00 | 1 << ISC11 | 1 << ISC10
  ldi r24, {enabled}
  out EIMSK, r24
  sbi PORTD, 2
  sbi PORTD, 3
  .rept 5
  nop
  .endr
"""
DONE = """
  cli
  out EIMSK, r1
  ldi r24, 1 << INTF0 | 1 << INTF1
  out EIFR, r24
  cbi PORTD, 2
  cbi PORTD, 3
"""
ONE = RAISED.format(enabled="1 << INT0")
TWO = RAISED.format(enabled="1 << INT0 | 1 << INT1")

# Compare A of Timer 1 matches 100 counts after `begin`; its interrupt makes the second stamp.
MATCH_DISTANCE = 100
MATCH = f"""
  clr r8
  begin
  match_after UNIT_A, {MATCH_DISTANCE}
  store TIMSK1, 1 << OCIE1A
  sei
"""
UNMATCH = "cli\nsts TIMSK1, r1"
# The flag is set one count after the match (figure 16-10), and the stamp reads in its second cycle.
MATCH_AROUND = MATCH_DISTANCE + 1 + JMP + 1

ROWS = [
    row(
        what="entry into an interrupt that waits, after SEI and one NOP",
        expected=ENTRY,
        source=RESPONSE,
        code=f"{ONE}\nbegin\nsei\nnop\n{DONE}",
        around=STAMP_CYCLES + 1 + 1 + JMP,
    ),
    row(
        what="the one instruction that runs after SEI: a JMP",
        expected=3,
        source="7.7",
        code=f"{ONE}\nbegin\nsei\njmp 1f\n1:\n{DONE}",
        around=STAMP_CYCLES + 1 + ENTRY + JMP,
    ),
    row(
        what="RETI, then at once the interrupted program",
        expected=RETI,
        source=RESPONSE,
        code=f"{ONE}\nsei\nnop\nmovw r2, r4\nfinish\n{DONE}",
        around=STAMP_CYCLES + 1 + 1,
    ),
    row(
        what="the one instruction that runs between two interrupts: a NOP",
        expected=1,
        source="7.7",
        code=f"{TWO}\nsei\nnop\nnop\nmovw r2, r4\nmovw r4, r10\n{DONE}",
        around=STAMP_CYCLES + 1 + RETI + ENTRY + JMP,
    ),
    row(
        what="the one instruction that runs between two interrupts: a JMP",
        expected=3,
        source="7.7",
        code=f"{TWO}\nsei\nnop\njmp 1f\n1:\nmovw r2, r4\nmovw r4, r10\n{DONE}",
        around=STAMP_CYCLES + 1 + RETI + ENTRY + JMP,
    ),
    row(
        what="from the flag of compare A to its interrupt, in NOPs",
        expected=ENTRY,
        source=RESPONSE,
        code=f"{MATCH}\n.rept 200\nnop\n.endr\n{UNMATCH}",
        around=MATCH_AROUND,
    ),
    row(
        what="the same, from idle sleep",
        expected=ENTRY + 4,
        source=RESPONSE,
        code=f"{MATCH}\nsleep\nnop\n{UNMATCH}",
        around=MATCH_AROUND,
    ),
    row(
        what="RETI behind a sleep: to the instruction after SLEEP",
        expected=RETI,
        source=RESPONSE,
        code=f"{MATCH}\nsleep\nmovw r2, r4\nfinish\n{UNMATCH}",
        around=STAMP_CYCLES + 1 + 1,
    ),
    row(
        what="pin change (A5, by SBI) to its interrupt, in NOPs",
        expected=(2 + ENTRY, 4 + ENTRY),
        source="figure 13-1: about 3; 7.7.1",
        code="""
          sbi DDRC, 5
          store PCMSK1, 1 << PCINT13
          store PCICR, 1 << PCIE1
          sbi PCIFR, PCIF1
          sei
          begin
          sbi PORTC, 5
          .rept 20
          nop
          .endr
          cli
          sts PCICR, r1
          sts PCMSK1, r1
          cbi PORTC, 5
          cbi DDRC, 5
        """,
        around=STAMP_CYCLES + 2 + JMP,
    ),
]
