"""Registration: the deformation that takes the template to the patient."""

from heartgen.registration.deformation import Deformation, GridMap, NodeGrid
from heartgen.registration.shirt import register

__all__ = ["Deformation", "GridMap", "NodeGrid", "register"]
