"""Templates: idealized ventricles tailored to the measurements of a patient."""

from heartgen.templates.biventricular import biventricular_template
from heartgen.templates.ellipsoid import TruncatedEllipsoid, fit_ellipsoid
from heartgen.templates.lv import lv_template

__all__ = ["TruncatedEllipsoid", "biventricular_template", "fit_ellipsoid", "lv_template"]
