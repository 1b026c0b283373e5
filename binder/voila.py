"""Voila's configuration for the lessons: pages of text have margins; the apps fill the window."""

from pathlib import PurePosixPath

from nbformat.v4 import new_markdown_cell

MARGINS = """<style>
  body[data-voila="voila"] { color-scheme: light; background: white !important; }
  #rendered_cells > div { max-width: 62rem; margin: 0 auto; padding: 1rem 1.25rem 4rem; }
  #rendered_cells img { max-width: 100%; height: auto; }
  #rendered_cells .jp-RenderedMarkdown { line-height: 1.6; }
  #rendered_cells .jp-Cell-outputWrapper { padding: 0.25rem 5px !important; }
  #rendered_cells pre { word-break: normal; overflow-wrap: anywhere; }
  #rendered_cells mjx-container[display="true"] { overflow-x: auto; overflow-y: hidden; }
</style>"""


def with_margins(handler, notebook, cwd):
    """Add margins to a page, unless it is an app."""
    if PurePosixPath(cwd).name != "apps":
        notebook.cells.insert(0, new_markdown_cell(MARGINS))


c = get_config()  # noqa: F821
c.VoilaConfiguration.prelaunch_hook = with_margins
