"""Every instruction of the AVRe+ set: the manual's cycles, for branches and skips in each of their cases.

Not here: SPM, which the firmware does not use and whose time is that of the flash.
"""

from __future__ import annotations

from tools.tests.calibration.rows import STAMP_CYCLES, Row, timed

FLAGS = "CZNVSHTI"
MANUAL = "manual, {}"


def row(what: str, expected: int, code: str, before: str = "", after: str = "") -> Row:
    """One instruction's row; its first word is the mnemonic."""
    mnemonic = what.partition(" ")[0].rstrip(",")
    return Row(
        group="Instructions",
        what=what,
        expected=expected,
        source=MANUAL.format(mnemonic),
        code=timed(code, before, after),
        around=STAMP_CYCLES,
    )


def plain() -> list[Row]:
    """Those that take the same time always and lead to the next instruction."""
    two_registers = ["ADD", "ADC", "SUB", "SBC", "AND", "OR", "EOR", "CP", "CPC", "MOV"]
    constant = ["SUBI", "SBCI", "ANDI", "ORI", "CPI", "LDI"]
    one_register = ["COM", "NEG", "INC", "DEC", "ASR", "LSR", "ROR", "SWAP"]
    aliases = ["TST", "CLR", "LSL", "ROL"]  # of AND, EOR, ADD, ADC
    products = ["MUL", "MULS", "MULSU", "FMUL", "FMULS", "FMULSU"]
    loads = ["X", "X+", "-X", "Y", "Y+", "-Y", "Z", "Z+", "-Z"]
    return [
        *(row(f"{name} Rd,Rr", 1, f"{name} r16, r17") for name in two_registers),
        *(row(f"{name} Rd,K", 1, f"{name} r16, 5") for name in constant),
        *(row(f"{name} Rd,K", 1, f"{name} r16, 5") for name in ("SBR", "CBR")),
        *(row(f"{name} Rd", 1, f"{name} r16") for name in one_register + aliases),
        row("SER Rd", 1, "ser r16"),
        row("MOVW Rd,Rr", 1, "movw r16, r26"),
        row("ADIW Rd,K", 2, "adiw r24, 63"),
        row("SBIW Rd,K", 2, "sbiw r24, 63"),
        *(row(f"{name} Rd,Rr", 2, f"{name} r16, r17") for name in products),
        *(row(f"LD Rd,{pointer}", 2, f"ld r16, {pointer}") for pointer in loads),
        *(row(f"LDD Rd,{pointer}+q", 2, f"ldd r16, {pointer}+5") for pointer in "YZ"),
        row("LDS Rd,k", 2, "lds r16, SCRATCH"),
        *(row(f"ST {pointer},Rr", 2, f"st {pointer}, r16") for pointer in loads),
        *(row(f"STD {pointer}+q,Rr", 2, f"std {pointer}+5, r16") for pointer in "YZ"),
        row("STS k,Rr", 2, "sts SCRATCH, r16"),
        row("LPM", 3, "lpm"),
        row("LPM Rd,Z", 3, "lpm r16, Z"),
        row("LPM Rd,Z+", 3, "lpm r16, Z+"),
        row("IN Rd,A", 1, "in r16, GPIOR0"),
        row("OUT A,Rr", 1, "out GPIOR0, r16"),
        row("PUSH Rr", 2, "push r16", after="pop r16"),
        row("POP Rd", 2, "pop r16", before="push r16"),
        row("SBI A,b", 2, "sbi GPIOR0, 1"),
        row("CBI A,b", 2, "cbi GPIOR0, 1"),
        row("BST Rr,b", 1, "bst r16, 3"),
        row("BLD Rd,b", 1, "bld r16, 3"),
        *(row(f"SE{flag}, a BSET", 1, f"se{flag}", after="cli") for flag in FLAGS),
        *(row(f"CL{flag}, a BCLR", 1, f"cl{flag}") for flag in FLAGS),
        row("NOP", 1, "nop"),
        row("WDR", 1, "wdr"),
        row("BREAK, without a debugger", 1, "break"),
        row("SLEEP, not enabled", 1, "sleep", before="out SMCR, r16", after="ldi r16, 1 << SE\nout SMCR, r16"),
    ]


def jumps() -> list[Row]:
    """To the next address, so that nothing else is measured."""
    here = "ldi r30, pm_lo8(1f)\nldi r31, pm_hi8(1f)"
    forget = "pop r16\npop r16"
    pushed = f"{here}\npush r30\npush r31"
    return [
        row("RJMP", 2, "rjmp 1f\n1:"),
        row("JMP", 3, "jmp 1f\n1:"),
        row("IJMP", 2, "ijmp\n1:", before=here),
        row("RCALL", 3, "rcall 1f\n1:", after=forget),
        row("CALL", 4, "call 1f\n1:", after=forget),
        row("ICALL", 3, "icall\n1:", before=here, after=forget),
        row("RET", 4, "ret\n1:", before=pushed),
        row("RETI", 4, "reti\n1:", before=pushed, after="cli"),
    ]


def branches() -> list[Row]:
    """BRBS and BRBC with each flag, taken and not."""
    rows = []
    for number, flag in enumerate(FLAGS):
        for name, taken_if in (("BRBS", "se"), ("BRBC", "cl")):
            not_if = "cl" if taken_if == "se" else "se"
            code = f"{name} {number}, 1f\n1:"
            rows.append(row(f"{name} {flag}, taken", 2, code, before=f"{taken_if}{flag}", after="cli"))
            rows.append(row(f"{name} {flag}, not taken", 1, code, before=f"{not_if}{flag}", after="cli"))
    return rows


def skips() -> list[Row]:
    """One cycle, two when a word is skipped, three when the instruction skipped has two words."""
    # what each compares with, and code that makes it skip or not
    cases = {
        "CPSE r16,r18": ("mov r18, r16", "mov r18, r17"),
        "SBRC r18,0": ("ldi r18, 0", "ldi r18, 1"),
        "SBRS r18,0": ("ldi r18, 1", "ldi r18, 0"),
        "SBIC GPIOR0,0": ("cbi GPIOR0, 0", "sbi GPIOR0, 0"),
        "SBIS GPIOR0,0": ("sbi GPIOR0, 0", "cbi GPIOR0, 0"),
    }
    rows = []
    for instruction, (skipping, going_on) in cases.items():
        name = instruction.partition(" ")[0]
        rows += [
            row(f"{name}, no skip", 1, instruction, before=going_on),
            row(f"{name}, one word skipped", 2, f"{instruction}\nnop", before=skipping),
            row(f"{name}, two words skipped (LDS)", 3, f"{instruction}\nlds r16, SCRATCH", before=skipping),
            row(f"{name}, two words skipped (STS)", 3, f"{instruction}\nsts SCRATCH, r16", before=skipping),
            row(f"{name}, two words skipped (JMP)", 3, f"{instruction}\njmp main", before=skipping),
            row(f"{name}, two words skipped (CALL)", 3, f"{instruction}\ncall main", before=skipping),
        ]
    return rows


ROWS = [row("(nothing: two stamps, one behind the other)", 0, ""), *plain(), *jumps(), *branches(), *skips()]
