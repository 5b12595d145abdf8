"""index.html: all experiments of a run on one page, offline: verdicts, figures, what was measured and expected."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from boebot import resources
from boebot_course.experiment import Experiment
from boebot_course.output_files import stem
from boebot_course.running import Verdict

NAME = "index.html"
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
STYLE = """
  :root { color-scheme: light dark; --paper: #fbfaf7; --card: #fff; --ink: #2e3440; --faint: #5f6672; --line: #e4e3dd;
    --link: #00609a; --met: #00704f; --missed: #b3400a; }
  @media (prefers-color-scheme: dark) { :root { --paper: #16181d; --card: #1f2229; --ink: #e6e7ea; --faint: #a0a5b0;
    --line: #353a44; --link: #74bdf0; --met: #4ecba2; --missed: #ff9a5c; } }
  * { box-sizing: border-box; }
  body { margin: 0; background: var(--paper); color: var(--ink);
    font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
  main { max-width: 960px; margin: 0 auto; padding: 20px 16px 60px; }
  h1 { font-size: 24px; margin: 0 0 4px; } h2 { font-size: 19px; margin: 0 0 2px; }
  a { color: var(--link); } p { margin: 6px 0; }
  .faint, figcaption { color: var(--faint); }
  section, nav { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 14px 18px;
    margin-top: 18px; }
  .wide { overflow-x: auto; }
  table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
  th, td { text-align: left; padding: 3px 14px 3px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
  th { color: var(--faint); font-weight: 600; }
  tr:last-child td { border-bottom: 0; }
  td.number, th.number { text-align: right; white-space: nowrap; }
  figure { margin: 12px 0; } figure img { width: 100%; height: auto; display: block; border-radius: 6px; }
  .met { color: var(--met); font-weight: 600; } .missed, .failed { color: var(--missed); font-weight: 600; }
  @media print { section { break-inside: avoid; } }
"""


def page(experiments: Sequence[Experiment], verdicts: Sequence[Verdict], seed: int) -> bytes:
    """The page; verdicts in the order of the experiments, with their files."""
    pairs = list(zip(experiments, verdicts, strict=True))
    met = sum(verdict.is_met for verdict in verdicts)
    title = "Experiments of the notes"
    parts = [
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n<style>{STYLE}</style>\n</head>\n'
        "<body>\n<main>",
        f"<h1>{title}</h1>",
        f'<p class="faint">{met} of {len(pairs)} met · seed {seed} · boebot {escape(resources.version())}</p>',
        _contents(pairs),
        *(_section(experiment, verdict) for experiment, verdict in pairs),
        "</main>\n</body>\n</html>\n",
    ]
    return "\n".join(parts).encode()


def _contents(pairs: Sequence[tuple[Experiment, Verdict]]) -> str:
    rows = "\n".join(
        f'<tr><td><a href="#{stem(one.name)}">{escape(one.name)}</a></td><td>{escape(one.title)}</td>'
        f"<td>{escape(one.robot)}</td><td>{_word(verdict)}</td></tr>"
        for one, verdict in pairs
    )
    return (
        '<nav class="wide"><table>\n<tr><th>name</th><th>title</th><th>robot</th><th>verdict</th></tr>\n'
        f"{rows}\n</table></nav>"
    )


def _section(experiment: Experiment, verdict: Verdict) -> str:
    name = stem(experiment.name)
    parts = [
        f'<section id="{name}">',
        f"<h2>{escape(experiment.name)}: {escape(experiment.title)}</h2>",
        f'<p class="faint">Notes: {escape(experiment.source)} · robot: {escape(experiment.robot)} · '
        f"{_word(verdict)}</p>",
    ]
    if verdict.error:
        parts.append(f'<p class="failed">{escape(verdict.error)}</p>')
    else:
        image = base64.b64encode(verdict.files[f"{name}.png"]).decode()
        parts += [
            f'<figure><img alt="{escape(experiment.caption)}" src="data:image/png;base64,{image}">'
            f"<figcaption>{escape(experiment.caption)}</figcaption></figure>",
            _measured(verdict),
        ]
    parts.append(f"<p><b>Criterion.</b> {escape(experiment.criterion)}</p>")
    links = " · ".join(f'<a href="{file}">{file.rpartition(".")[2].upper()}</a>' for file in verdict.files)
    parts.append(f"<p>{links}</p>" if links else "")
    return "\n".join(parts) + "\n</section>"


def _measured(verdict: Verdict) -> str:
    rows = "\n".join(
        f'<tr><td>{escape(one.name)}</td><td class="number">{one.text}</td><td>{escape(one.expected)}</td>'
        f'<td>{escape(one.unit)}</td><td class="{"met" if one.is_met else "missed"}">'
        f"{'met' if one.is_met else 'missed'}</td></tr>"
        for one in verdict.measured
    )
    return (
        '<div class="wide"><table>\n<tr><th>figure</th><th class="number">measured</th><th>expected</th><th>unit</th>'
        f"<th></th></tr>\n{rows}\n</table></div>"
    )


def _word(verdict: Verdict) -> str:
    return f'<span class="{verdict.word}">{verdict.word}</span>'
