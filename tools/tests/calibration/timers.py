"""The timers in the modes that the firmware uses: Timer 1 normal at clk/1 with capture and both compare units, Timer 2
clear-on-match at clk/1, Timer 0 clear-on-match with prescalers.

Capture needs no wire: pin 8 is an output that the program moves, and the capture unit sees it (data sheet, 16.6).
"""

from __future__ import annotations

from functools import partial

from tools.tests.calibration.interrupts import ENTRY, JMP
from tools.tests.calibration.rows import LAP, Row

row = partial(Row, group="Timers")
PRESCALERS_0 = {1: 1, 2: 8, 3: 64, 4: 256, 5: 1024}  # table 15-9
INFRARED_TOP = 210  # 37.9 kHz, the carrier of the infrared detectors

# Two interrupts, from idle sleep.
TWO_INTERRUPTS = "clr r8\nsleep_until 3\nmovw r2, r4\nsleep_until 4"


def timer_0(clock_select: int, divider: int, top: int) -> Row:
    """The time from match to match."""
    return row(
        what=f"Timer 0, clear on match at {top}, clk/{divider}: match to match",
        expected=divider * (top + 1),
        source="15.7.2",
        code=f"""
          ldi r24, {top}
          out OCR0A, r24
          ldi r24, 1 << WGM01
          out TCCR0A, r24
          out TCNT0, r1
          store TIMSK0, 1 << OCIE0A
          ldi r24, {clock_select}
          out TCCR0B, r24
          {TWO_INTERRUPTS}
          out TCCR0B, r1
          sts TIMSK0, r1
          ldi r24, 1 << OCF0A
          out TIFR0, r24
        """,
    )


def timer_2(top: int) -> Row:
    """The carrier of the infrared detectors."""
    return row(
        what=f"Timer 2, clear on match at {top}, clk/1: match to match",
        expected=top + 1,
        source="18.7.2",
        code=f"""
          store OCR2A, {top}
          store TCCR2A, 1 << WGM21
          sts TCNT2, r1
          store TIMSK2, 1 << OCIE2A
          store TCCR2B, 1 << CS20
          {TWO_INTERRUPTS}
          sts TCCR2B, r1
          sts TIMSK2, r1
          ldi r24, 1 << OCF2A
          out TIFR2, r24
        """,
    )


def capture(noise_filter: int) -> Row:
    """The count that is captured against the cycle at whose end the pin moves."""
    cancelled = 4 * noise_filter
    return row(
        what=f"Timer 1, capture {'with' if noise_filter else 'without'} noise canceller: from edge to count kept",
        expected=3 + cancelled,
        source="16.6.2: 4 cycles; 17.3: 2.5 to 3.5" if noise_filter else "16.6.1, 17.3: 2.5 to 3.5",
        code=f"""
          sbi DDRB, 0
          cbi PORTB, 0
          store TCCR1B, {noise_filter} << ICNC1 | 1 << ICES1 | 1 << CS10
          .rept 16
          nop
          .endr
          sbi TIFR1, ICF1
          begin
          sbi PORTB, 0
          .rept 16
          nop
          .endr
          lds r12, ICR1L
          lds r13, ICR1H
          sub r12, r2
          sbc r13, r3
          cbi PORTB, 0
          cbi DDRB, 0
          store TCCR1B, 1 << CS10
          movw r24, r12
        """,
        is_number=True,
        around=1 + 2 + 2 + 2,  # from the reading in `begin` to the end of the SBI that moves the pin
        unit="counts",
    )


ROWS = [
    row(
        what="Timer 1, normal, clk/1: compare A to compare B, 400 counts apart",
        expected=400,
        source="16.9.1",
        code="""
          clr r8
          begin
          match_after UNIT_A, 300
          match_after UNIT_B, 700
          store TIMSK1, 1 << OCIE1A | 1 << OCIE1B
          sleep_until 1
          movw r2, r4
          sleep_until 2
          sts TIMSK1, r1
        """,
    ),
    row(
        what="Timer 1, normal, clk/1: compare A to compare A, one lap later",
        expected=LAP,
        laps=1,
        source="16.9.1",
        code="""
          clr r8
          begin
          match_after UNIT_A, 300
          store TIMSK1, 1 << OCIE1A
          sleep_until 1
          movw r2, r4
          sleep_until 2
          sts TIMSK1, r1
        """,
    ),
    row(
        what="Timer 1, overflow: the count at which its interrupt begins, from idle sleep",
        expected=0,
        source="16.9.1, figure 16-12",
        code="""
          clr r8
          sbi TIFR1, TOV1
          store TIMSK1, 1 << TOIE1
          sleep_until 1
          sts TIMSK1, r1
          movw r24, r4
        """,
        is_number=True,
        around=ENTRY + 4 + JMP + 1,
        unit="counts",
    ),
    row(
        what="Timer 1, compare output A: counts from the match to the edge at pin 9",
        expected=1,
        source="16.8, figure 16-10",
        code="""
          sbi DDRB, 1
          store TCCR1A, 1 << COM1A1 | 0 << COM1A0
          store TCCR1C, 1 << FOC1A            ; low
          store TCCR1A, 1 << COM1A1 | 1 << COM1A0
          begin
          movw r24, r2
          adiw r24, 40
          sts OCR1AH, r25
          sts OCR1AL, r24
          .rept 20
          nop
          .endr
          .irp n, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 26, 27
          in r\\n, PINB
          .endr
          clr r24
          .irp n, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 26, 27
          sbrs r\\n, 1
          inc r24
          .endr
          clr r25
          sts TCCR1A, r1
          cbi DDRB, 1
        """,
        # The first sample comes 32 counts after the one that `begin` read, the first that sees the edge one cycle
        # after it (figure 14-4).
        is_number=True,
        around=9,
        unit="counts",
    ),
    capture(0),
    capture(1),
    *(timer_0(select, divider, 99 if divider < 256 else 24) for select, divider in PRESCALERS_0.items()),
    timer_2(INFRARED_TOP),
]
