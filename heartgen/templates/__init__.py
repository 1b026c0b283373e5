"""Templates: idealized ventricles tailored to the measurements of a patient."""

from heartgen.templates.biventricular import biventricular_template
from heartgen.templates.lv import lv_template

__all__ = ["biventricular_template", "lv_template"]
