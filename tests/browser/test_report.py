"""The report that opens anywhere: what it shows, and what it tells."""

from __future__ import annotations

import re

import pytest

import heartgen
from heartgen import samples
from heartgen.viewing import view_html
from heartgen.viewing.scene import nice_limit
from tests.browser.axe import violations_by_theme

pytestmark = pytest.mark.slow

PATIENCE = 120_000
"""Milliseconds."""


@pytest.fixture(scope="module")
def result():
    """A stack, whose mask would be a matter of interpolation."""
    return heartgen.personalize(samples.load("stack").mask, optimize=False)


@pytest.fixture(scope="module")
def report(browser, result, tmp_path_factory):
    path = view_html(result, tmp_path_factory.mktemp("report") / "report.html")
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(PATIENCE)
    page.goto(path.as_uri(), timeout=PATIENCE)
    page.frame_locator("iframe").locator("canvas").first.wait_for()
    yield page
    page.close()


def test_report_of_a_stack_shows_contours_on_the_scale_of_the_page(report, result):
    key = report.locator(".key").inner_text()
    assert "contours in the slices" in key
    assert f"{nice_limit(result.report.accuracy.p95):g} or more" in key


def test_value_under_the_mouse_is_told(report):
    box = report.locator("iframe").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    told = report.frame_locator("iframe").locator("output")
    for step in range(60):
        report.mouse.move(x + step % 7, y + step % 5)
        if told.count() and told.is_visible():
            break
        report.wait_for_timeout(500)
    text = told.inner_text()
    found = re.fullmatch(r"distance to the mask (\d+\.\d\d) mm", text)
    assert found, text
    assert float(found[1]) < 10
    report.mouse.move(5, 5)


def test_report_is_for_everybody_and_has_no_scrollbars_of_its_own(report):
    assert violations_by_theme(report) == []
    scrolled = report.evaluate(
        "() => [...document.querySelectorAll('aside, main')]"
        ".filter(e => e.scrollHeight > e.clientHeight + 1 "
        "&& getComputedStyle(e).overflowY !== 'visible').length"
    )
    assert scrolled == 0
    report.set_viewport_size({"width": 390, "height": 844})
    assert report.evaluate("() => document.documentElement.scrollWidth") <= 390
