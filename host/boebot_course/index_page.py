"""index.html: all experiments of a run on one page, offline: verdicts, figures, what was measured and expected."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from boebot import resources
from boebot_course.experiment import Experiment
from boebot_course.running import Verdict

NAME = "index.html"
HEAD = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>Experiments of the notes</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<style>
  :root { color-scheme: light dark; }
  body { margin: 20px auto; max-width: 960px; padding: 0 16px; font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
  td, th { text-align: left; padding: 2px 14px 2px 0; vertical-align: top; }
  img { width: 100%; height: auto; }
  .missed, .failed { color: #d0451b; font-weight: 600; }
</style>
<h1>Experiments of the notes</h1>
"""


def page(experiments: Sequence[Experiment], verdicts: Sequence[Verdict], seed: int) -> bytes:
    """The page; verdicts in the order of the experiments, with their files."""
    pairs = list(zip(experiments, verdicts, strict=True))
    met = sum(verdict.is_met for verdict in verdicts)
    contents = [(f'<a href="#{one.name}">{one.name}</a>', escape(one.title), _word(said.word)) for one, said in pairs]
    parts = [
        f"{HEAD}<p>{met} of {len(pairs)} met · seed {seed} · boebot {escape(resources.version())}</p>",
        _table(("name", "title", "verdict"), contents),
        *(_section(one, verdict) for one, verdict in pairs),
    ]
    return "\n".join(parts).encode()


def _section(one: Experiment, verdict: Verdict) -> str:
    title, caption = escape(one.title), escape(one.caption)
    parts = [
        f'<h2 id="{one.name}">{one.name}: {title}</h2>',
        f"<p>Notes: {escape(one.source)} · robot: {escape(one.robot)} · {_word(verdict.word)}</p>",
    ]
    if verdict.error:
        parts.append(f'<p class="failed">{escape(verdict.error)}</p>')
    else:
        image = base64.b64encode(verdict.files[f"{one.name}.png"]).decode()
        rows = [
            (escape(figure.name), figure.text, escape(figure.expected), escape(figure.unit), _word(figure.word))
            for figure in verdict.measured
        ]
        parts += [
            f'<p><img alt="{caption}" src="data:image/png;base64,{image}">{caption}</p>',
            _table(("figure", "measured", "expected", "unit", ""), rows),
        ]
    links = " · ".join(f'<a href="{file}">{file}</a>' for file in verdict.files)
    return "\n".join([*parts, f"<p><b>Criterion.</b> {escape(one.criterion)}</p>", f"<p>{links}</p>"])


def _table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"<tr><th>{'<th>'.join(titles)}", *(f"<tr><td>{'<td>'.join(row)}" for row in rows)]
    return "\n".join(["<table>", *lines, "</table>"])


def _word(word: str) -> str:
    return f'<span class="{word}">{word}</span>'
