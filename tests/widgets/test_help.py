from __future__ import annotations

import json
from pathlib import Path

from heartgen.widgets.glossary import words
from heartgen.widgets.help import SHORTCUTS, TOUR, Help


def test_every_row_of_the_glossary_is_a_word(repository: Path):
    text = (repository / "docs" / "glossary.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    heads = text.count("| word |")
    assert len(words()) == len(rows) - heads > 40
    found = {word.word: word for word in words()}
    assert found["Dice"].unit == "0 to 1"
    assert "<code>lod</code>" in next(w for w in found if w.startswith("level of detail"))
    assert {"Q", "LoD"} <= {part for w in words() for part in w.paper.replace(",", "").split()}


def test_glossary_cannot_break_the_page():
    for word in words():
        for text in (word.word, word.unit, word.paper, word.meaning):
            plain = text
            for tag in ("code", "i"):
                plain = plain.replace(f"<{tag}>", "").replace(f"</{tag}>", "")
            assert "<" not in plain.replace("<a href=", "").replace("</a>", "")


def test_tour_has_seven_steps_and_keys_are_told_apart():
    assert len(TOUR) == 7
    keys = [each.key for each in SHORTCUTS]
    assert len(set(keys)) == len(keys)
    assert "?" not in keys
    state = Help(TOUR, SHORTCUTS).get_state()
    assert len(json.dumps(state["words"])) > 1000
