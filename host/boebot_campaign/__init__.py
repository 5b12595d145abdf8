"""Campaigns: many runs of one plan, on all processors of this computer or on a cluster.

    sweep.toml ─plan─▶ row number ─▶ Case ─rows─▶ one run ─▶ row ─kept─▶ parts/*.parquet ─▶ rows.parquet ─▶ report

A guest of `boebot`: it is joined by entry points, and the core neither imports nor names it. `engine` spreads the rows
over Dask's workers; which rows there are, and what each holds, depends on the plan alone.
"""

from boebot.guests import Command, Folder

COMMAND = Command(
    "Run brains in all the ways that a file says, and keep a row of each run.", "boebot_campaign.command:sweep"
)
EVOLVE = Command(
    "Find parameters with which a brain does better, as a file says.", "boebot_campaign.evolution:evolve_command"
)
MATTERS = Command("Find out which imperfections a brain's result hangs on.", "boebot_campaign.matters:matters_command")
FOLDER = Folder("boebot_campaign.report:report", "boebot_campaign.sweep:kept_request")
SEVERAL = Folder("boebot_campaign.sweep:no_rows", "boebot_campaign.sweep:no_rows")
