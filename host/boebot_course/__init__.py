"""The course: the experiments of the lecture notes, each run by one command, `boebot experiment NAME`.

A guest of `boebot`: it is joined by an entry point, and the core neither imports nor names it. `experiments` holds one
topic per file; what experiments share is beside it.
"""

from boebot.guests import Command

COMMAND = Command(
    "Run experiments of the notes: figures, measured against expected.", "boebot_course.command:experiment"
)
