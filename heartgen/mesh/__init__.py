"""Numerics of tricubic hexahedral meshes: elements, quadrature, surfaces, projection, validity."""

from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import HexMesh, Topology

__all__ = ["HexMesh", "MeshField", "Topology"]
