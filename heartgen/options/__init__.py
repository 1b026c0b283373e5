"""What the user may choose: each option is declared once, in `heartgen.options.declared`."""

from heartgen.options.choosing import chosen
from heartgen.options.declared import ANALYZED, OPTIONS, Options
from heartgen.options.defaults import (
    BIV_ELEMENTS,
    HOLE_SHARE,
    LV_ELEMENTS,
    OPTIMIZED_PASSES,
    OPTIMIZED_PASSES_OF_ONE,
    STEPS,
    usual_elements,
)
from heartgen.options.option import Option, as_text
from heartgen.options.text import (
    option_from_text,
    options_from_text,
    setting_from_text,
    settings_from_text,
)
from heartgen.options.values import QUALITY_LIMITS, Apex, Insertion
from heartgen.renamed import keep_former_names

__all__ = [
    "ANALYZED",
    "BIV_ELEMENTS",
    "HOLE_SHARE",
    "LV_ELEMENTS",
    "OPTIMIZED_PASSES",
    "OPTIMIZED_PASSES_OF_ONE",
    "OPTIONS",
    "QUALITY_LIMITS",
    "STEPS",
    "Apex",
    "Insertion",
    "Option",
    "Options",
    "as_text",
    "chosen",
    "option_from_text",
    "options_from_text",
    "setting_from_text",
    "settings_from_text",
    "usual_elements",
]

keep_former_names(__name__)
