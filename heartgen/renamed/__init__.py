"""Former names, which work until `REMOVED_IN` and warn with the new ones.

Names that users type or import warn. Files of former versions are read without a word: whoever
opens one has nothing to mend in it.
"""

from __future__ import annotations

from heartgen.renamed.callables import (
    has_former_attributes,
    takes_former_keywords,
    takes_former_options,
)
from heartgen.renamed.importing import FormerModules, keep_former_names, new_module
from heartgen.renamed.tables import (
    COLUMN_START,
    COLUMNS,
    FLAGS,
    KEYWORDS,
    MODULES,
    MOVED,
    NAMES,
    OPTIONS,
    REMOVED_IN,
    REPLACED,
    REPORT,
    SURFACES,
    WORDS,
)
from heartgen.renamed.values import (
    former_options,
    new_column,
    new_flags,
    new_options,
    new_row,
    new_setting,
    new_table,
    new_word,
)

__all__ = [
    "COLUMNS",
    "COLUMN_START",
    "FLAGS",
    "KEYWORDS",
    "MODULES",
    "MOVED",
    "NAMES",
    "OPTIONS",
    "REMOVED_IN",
    "REPLACED",
    "REPORT",
    "SURFACES",
    "WORDS",
    "FormerModules",
    "former_options",
    "has_former_attributes",
    "keep_former_names",
    "new_column",
    "new_flags",
    "new_module",
    "new_options",
    "new_row",
    "new_setting",
    "new_table",
    "new_word",
    "takes_former_keywords",
    "takes_former_options",
]
