"""Registration: the deformation that takes the template to the patient."""

from heartgen.registration.deformation import Deformation, GridMap, NodeGrid
from heartgen.registration.shirt import Steering, register

__all__ = ["Deformation", "GridMap", "NodeGrid", "Steering", "register"]
