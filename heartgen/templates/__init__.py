"""Templates: idealised ventricles tailored to the measurements of a patient."""

from heartgen.templates.lv import lv_template

__all__ = ["lv_template"]
