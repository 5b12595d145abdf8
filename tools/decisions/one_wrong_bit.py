"""Untouched frames lost per damaged one, by kind of fault, with and without the rule that refuses the rest of a frame.

Prints the table of docs/decisions/0006-one-wrong-bit.md: `python -m tools.decisions.one_wrong_bit`.
"""

from __future__ import annotations

from tools.error_rates.library import ENDS
from tools.error_rates.streams import FAULTS, pooled, through_c

ROUNDS = 300_000


def main() -> None:
    """Prints it."""
    print("| fault | " + " | ".join(f"{end}, before | after" for end in ENDS) + " |")
    print("|---" * (1 + 2 * len(ENDS)) + "|")
    runs = {
        (end, without): [through_c(end, fault, ROUNDS, without=without) for fault in range(len(FAULTS))]
        for end in ENDS
        for without in ("rest", "")
    }
    rows = [[tallies[fault] for tallies in runs.values()] for fault in range(len(FAULTS))]
    for name, row in zip((*FAULTS, "all"), [*rows, [pooled(tallies) for tallies in runs.values()]], strict=True):
        print(f"| {name} | " + " | ".join(f"{tally.lost_rate:.5f}" for tally in row) + " |")


if __name__ == "__main__":
    main()
