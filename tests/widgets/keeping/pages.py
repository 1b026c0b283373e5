"""Pages of the dashboard without a browser, and what a browser says to them."""

from __future__ import annotations

from heartgen.widgets import dashboard

WAITING = 300


def told(page, **message):
    """What the browser says."""
    page.back.keeper._handle_custom_msg({"kind": "hello", "mine": "", "left": [], **message}, [])


def opened(sample=None, **message):
    """A page that is on the screen, its input read and measured."""
    widget = dashboard(sample)
    told(widget.page, **message)
    settled(widget.session)
    return widget.page


def settled(session):
    """Wait until everything that was begun is done."""
    session._pool.submit(lambda: None).result(WAITING)
    session._fits.submit(lambda: None).result(WAITING)


def left(page):
    """The kernel ends, with whatever it does."""
    page.others.close()
    page.session.close()
