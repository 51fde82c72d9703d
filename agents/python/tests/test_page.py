"""Whether all of a page of results can be seen."""

import re

import pytest

from causeway.evaluate import Cell, Episode, summarise
from causeway.evaluate.page import page

#: Of a letter of the plots, in pixels, in whatever sans-serif font there is.
LETTER_PX = 8.0


@pytest.fixture
def text():
    """The page of episodes that all arrived: its labels are the longest."""
    named = ("success", "cause", "completion", "secs", "driven_m", "return", "mean_beside_m")
    numbers = dict.fromkeys((*named, "steps", "pair"), 1.0)
    cell = Cell("corl17-navigation", "Town10HD", "kinematic", "follow")
    episodes = [Episode(cell, 1, number, "00", numbers) for number in range(4)]
    return page(summarise(episodes), [], episodes)


def test_labels_end_within_their_plots(text):
    widths = re.findall(r'<svg width="(\d+)"', text)
    labels = re.findall(r'<text x="(\d+)" y="[\d.]+">([\d.]+ % \(.+?\))<', text)
    assert len(widths) == len(labels) == 2
    assert "100.0 % (100.0 to 100.0)" in dict(labels).values()
    for width, (x, label) in zip(widths, labels, strict=True):
        assert int(x) + LETTER_PX * len(label) <= int(width)


def test_tables_and_plots_are_no_wider_than_the_page(text):
    assert text.count("<table>") == text.count('<div class="table"><table>') >= 3
    assert ".table { overflow-x: auto;" in text and "svg { max-width: 100%;" in text
