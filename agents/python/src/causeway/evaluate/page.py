"""Results as one HTML page that needs no network."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

from causeway.evaluate.compare import Difference
from causeway.evaluate.conditions import CONDITIONS, Row
from causeway.evaluate.episodes import Episode
from causeway.evaluate.intervals import Interval
from causeway.evaluate.score import PENALTIES
from causeway.evaluate.summary import Summary

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; color: #222;
  padding: 0 1rem; }
.table { overflow-x: auto; margin: 1rem 0 2rem; }
table { border-collapse: collapse; font-size: 13px; }
th, td { padding: .25rem .6rem .25rem 0; text-align: left; border-bottom: 1px solid #ddd; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
svg { max-width: 100%; height: auto; }
svg text { font: 13px system-ui, sans-serif; fill: #222; }
.better { color: #1a7f37; } .worse { color: #b3261e; }
"""
#: Of a plot, in pixels: the names' column, the axis, the column of values, and a line.
NAMES_PX, AXIS_PX, VALUES_PX, LINE_PX = 300, 500, 240, 26
#: Failures that the page lists.
FAILURES = 200


#: What `completion` is on ways, and what their page says of who drove them.
WAY = "share of the way"
SUCCESS = "Policies see the state of their vehicle and way, not pictures."
#: What that of dilemmas says.
REWARD = "Success is the benchmark's reward for what was decided at once."


def page(
    summaries: Sequence[Summary],
    differences: Sequence[Difference],
    episodes: Iterable[Episode],
    share: str = WAY,
    conditions: Sequence[Row] = (),
) -> str:
    """The text of the page; `share`: what `completion` is; `conditions`: a table of them."""
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8><title>Evaluation</title>",
        f"<style>{STYLE}</style><h1>Evaluation</h1>",
        "<p>Bars are intervals of 95 %: Wilson's for shares of episodes, of resampled episodes for "
        f"means and rates. {SUCCESS if share == WAY else REWARD}</p>",
        *([_conditions(conditions)] if conditions else []),
        *_plots(summaries, share),
        _table(summaries, share),
        _infractions(summaries),
    ]
    if differences:
        parts.append(_differences(differences, share))
    parts.append(_failures(episodes, share))
    return "\n".join(parts) + "\n"


def _plots(summaries: Sequence[Summary], share: str) -> Iterable[str]:
    groups: dict[str, list[Summary]] = {}
    for one in summaries:
        cell = one.cell
        groups.setdefault(f"{cell.task}, {cell.town}, {cell.tier}, {cell.weathers}", []).append(one)
    for name, members in groups.items():
        yield f"<h2>{html.escape(name)}</h2>"
        lines = [(one.cell.policy, one.success, one.success_interval) for one in members]
        yield _plot("success", lines)
        lines = [(one.cell.policy, one.completion, one.completion_interval) for one in members]
        yield _plot(share, lines)


def _plot(what: str, lines: Sequence[tuple[str, float, Interval]]) -> str:
    """Shares with their intervals, one below the other."""

    def x(share: float) -> float:
        return NAMES_PX + AXIS_PX * min(max(share, 0.0), 1.0)

    width, height = NAMES_PX + AXIS_PX + VALUES_PX, LINE_PX * (len(lines) + 2)
    parts = [
        f'<svg width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img">',
        f'<text x="0" y="{LINE_PX - 8}" font-weight="bold">{html.escape(what)}</text>',
    ]
    for tick in (0.0, 0.25, 0.5, 0.75, 1.0):
        parts.append(
            f'<line x1="{x(tick)}" x2="{x(tick)}" y1="{LINE_PX}" y2="{height - LINE_PX}" '
            f'stroke="#ddd"/><text x="{x(tick)}" y="{height - 8}" text-anchor="middle">'
            f"{100 * tick:.0f} %</text>"
        )
    for index, (name, share, (low, high)) in enumerate(lines):
        y = LINE_PX * (index + 1.5)
        parts.append(
            f'<text x="0" y="{y + 4}">{html.escape(name)}</text>'
            f'<line x1="{x(low):.1f}" x2="{x(high):.1f}" y1="{y}" y2="{y}" stroke="#4a7ebb" '
            f'stroke-width="3"/><circle cx="{x(share):.1f}" cy="{y}" r="5" fill="#1f4e8c"/>'
            f'<text x="{NAMES_PX + AXIS_PX + 12}" y="{y + 4}">{100 * share:.1f} % '
            f"({100 * low:.1f} to {100 * high:.1f})</text>"
        )
    return "".join([*parts, "</svg>"])


def _rows(head: Sequence[str], rows: Iterable[Sequence[str | float]]) -> str:
    def entry(value: str | float) -> str:
        if isinstance(value, str):
            return f"<td>{value}</td>"
        text = f"{value:.3f}" if isinstance(value, float) else str(value)
        return f'<td class="number">{text}</td>'

    first = "".join(f"<th>{html.escape(name)}</th>" for name in head)
    lines = "".join(f"<tr>{''.join(entry(value) for value in row)}</tr>" for row in rows)
    return f'<div class="table"><table><tr>{first}</tr>{lines}</table></div>'


def _table(summaries: Sequence[Summary], share: str) -> str:
    def span(interval: Interval, factor: float = 1.0) -> str:
        return f"{factor * interval[0]:.2f} to {factor * interval[1]:.2f}"

    rows = [
        (
            *(html.escape(text) for text in vars(one.cell).values()),
            *(one.episodes, 100 * one.success, span(one.success_interval, 100)),
            *(100 * one.completion, span(one.completion_interval, 100), one.km),
            *(one.infractions, one.infractions_per_km, span(one.infractions_interval)),
            *(one.mean_speed_mps, one.mean_beside_m),
        )
        for one in summaries
    ]
    head = [
        "task",
        "town",
        "tier",
        "policy",
        "weathers",
        "episodes",
        "success %",
        "95 %",
        f"{share}, %",
    ]
    head += ["95 %", "km", "infractions", "per km", "95 %", "m/s", "m beside"]
    return "<h2>All numbers</h2>" + _rows(head, rows)


def _conditions(rows: Sequence[Row]) -> str:
    lines = [(*(html.escape(text) for text in one.names), *one.texts()) for one in rows]
    head = ("task", "tier", "policy", *CONDITIONS)
    return "<h2>Success by condition, %</h2>" + _rows(head, lines)


def _infractions(summaries: Sequence[Summary]) -> str:
    rows: list[Sequence[str | float]] = [
        (
            html.escape(str(one.cell)),
            *one.per_km.values(),
            *(one.driving_scores[version] for version in PENALTIES),
        )
        for one in summaries
    ]
    head = ["cell", *(f"{kind} per km" for kind in summaries[0].per_km)] if summaries else ["cell"]
    head += [f"driving score {version}" for version in PENALTIES]
    note = (
        "<p>Driving scores are those of CARLA's leaderboard by version, as far as episodes tell: "
        "without stop signs, time-outs of scenarios, emergency vehicles and minimum speed.</p>"
    )
    return "<h2>Infractions and driving scores</h2>" + note + _rows(head, rows)


def _differences(differences: Sequence[Difference], share: str) -> str:
    rows = [
        (
            html.escape(str(one.cell)),
            f'<span class="{one.verdict}">{one.verdict}</span>',
            *(one.episodes, 100 * one.success_before, 100 * one.success, one.won, one.lost),
            *(one.chance, 100 * one.completion_change, len(one.changed)),
        )
        for one in differences
    ]
    head = ["cell", "verdict", "episodes", "success % before", "now", "won", "lost", "p"]
    head += [f"{share}, points", "changed episodes"]
    note = (
        "<p>p is that of McNemar's exact test over the same episodes, adjusted for the number of "
        "cells (Holm); below 0.05 a difference counts as more than chance.</p>"
    )
    return "<h2>Against the other run</h2>" + note + _rows(head, rows)


def _failures(episodes: Iterable[Episode], share: str) -> str:
    failed = [episode for episode in episodes if not episode.success]
    rows = [
        (
            *(html.escape(str(one.cell)), str(one.seed), str(one.number), one.cause),
            *(100 * one.numbers["completion"], one.numbers["secs"], int(one.numbers["pair"])),
        )
        for one in failed[:FAILURES]
    ]
    head = ("cell", "seed", "number", "ended by", f"{share}, %", "seconds", "pair")
    more = f", of which {FAILURES} are listed" if len(failed) > FAILURES else ""
    return f"<h2>Failures</h2><p>{len(failed)} episodes{more}.</p>" + _rows(head, rows)
