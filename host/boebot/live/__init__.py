"""The live view: a page in the browser that shows a run while it goes on, and may interfere with it.

page_server.py   serves the page and its stream, on loopback, to whoever has its address
messages.py      what pages ask for
audience.py       all pages: what each needs first, and what happens then
outbox.py        what waits to be sent to a page: the newest, never a queue
chunks.py        what happened since the last chunk, as the page draws it (boebot.view.page_data)
pace.py          how fast a simulated run goes: paused, step by step, at so many times real time
controls.py      what people want: from pages to the run, one page at a time by hand
live_view.py     the onlooker of a run (boebot.running.hands) that all of these make up
session.py       a run with a view: from the first page to the last restart
"""
