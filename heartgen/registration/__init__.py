"""Registration: the deformation that takes the template to the patient."""

from heartgen.registration.deformation import Deformation, NodeGrid
from heartgen.registration.shirt import register

__all__ = ["Deformation", "NodeGrid", "register"]
