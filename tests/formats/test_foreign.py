"""Every exact format of every kind of mesh, read by somebody else's reader."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from heartgen.fields import make_fields
from heartgen.formats import FORMATS, file_name, write_mesh
from heartgen.mesh import HexMesh, MeshField
from heartgen.mesh.jacobian import volume
from heartgen.mesh.quadrature import EXACT, gauss_cube

CLOSE = 1e-9
"""mm; the files are exact, sums are rounded."""

# --- readers: each gives places (e, q, 3), determinants (e, q) and a field at (q, 3) ------------


class ByVtk:
    """VTK: XML and legacy files."""

    def __init__(self, paths):
        xml, legacy = (pytest.importorskip(f"vtkmodules.vtkIO{kind}") for kind in ("XML", "Legacy"))
        self.to_numpy = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy
        if paths[0].suffix == ".vtu":
            reader = xml.vtkXMLUnstructuredGridReader()
        else:
            reader = legacy.vtkUnstructuredGridReader()
        reader.SetFileName(str(paths[0]))
        reader.Update()
        self.grid = reader.GetOutput()
        points = self.to_numpy(self.grid.GetPoints().GetData())
        self.cells = self.to_numpy(self.grid.GetCells().GetConnectivityArray()).reshape(-1, 64)
        self.points = points[self.cells]
        self.cell = self.grid.GetCell(0)

    def functions(self, xi):
        out = np.empty((len(xi), 64))
        for row, at in zip(out, xi.tolist(), strict=True):
            self.cell.InterpolateFunctions(at, row)
        return out

    def evaluate(self, xi):
        core = pytest.importorskip("vtkmodules.vtkCommonCore")
        out, part, place = np.empty((len(self.cells), len(xi), 3)), core.reference(0), [0.0] * 3
        weights = [0.0] * 64
        for e in range(len(out)):
            cell = self.grid.GetCell(e)
            for q, at in enumerate(xi.tolist()):
                cell.EvaluateLocation(part, at, place, weights)
                out[e, q] = place
        return out

    def determinants(self, xi):
        slopes = np.empty((len(xi), 3 * 64))
        for row, at in zip(slopes, xi.tolist(), strict=True):
            self.cell.InterpolateDerivs(at, row)
        slopes = slopes.reshape(len(xi), 64, 3)
        return np.linalg.det(np.einsum("qad,eax->eqxd", slopes, self.points))

    def field(self, name, xi):
        values = self.grid.GetPointData().GetArray(name)
        if values is None:
            constant = self.to_numpy(self.grid.GetCellData().GetArray(name))
            return np.repeat(constant.reshape(len(self.cells), 1, -1), len(xi), axis=1)
        own = self.to_numpy(values).reshape(len(self.to_numpy(values)), -1)[self.cells]
        return np.einsum("qa,eak->eqk", self.functions(xi), own)


class ByZinc:
    """Zinc, the library of the EX formats."""

    def __init__(self, paths):
        zinc = pytest.importorskip("cmlibs.zinc.context")
        self.context = zinc.Context("test")
        self.region = self.context.getDefaultRegion()
        for path in paths:
            assert self.region.readFile(str(path)) == 1
        assert self.context.getLogger().getNumberOfMessages() == 0
        self.module = self.region.getFieldmodule()
        self.mesh = self.module.findMeshByDimension(3)
        self.coordinates = self.module.findFieldByName("coordinates")

    def _values(self, field, xi, size):
        out = np.empty((self.mesh.getSize(), len(xi), size))
        cache = self.module.createFieldcache()
        for e, of_element in enumerate(out):
            element = self.mesh.findElementByIdentifier(e + 1)
            for q, at in enumerate(xi.tolist()):
                cache.setMeshLocation(element, at)
                answer, value = field.evaluateReal(cache, size)
                assert answer == 1
                of_element[q] = value
        return out

    def evaluate(self, xi):
        return self._values(self.coordinates, xi, 3)

    def determinants(self, xi):
        slopes = [self.module.createFieldDerivative(self.coordinates, d + 1) for d in range(3)]
        return np.linalg.det(np.stack([self._values(slope, xi, 3) for slope in slopes], -1))

    def field(self, name, xi):
        field = self.module.findFieldByName(name)
        return self._values(field, xi, field.getNumberOfComponents())


class ByGmsh:
    """Gmsh's own library."""

    def __init__(self, paths):
        try:
            import gmsh
        except (ImportError, OSError) as error:  # a wheel, or a library of the system, is missing
            pytest.skip(f"Gmsh cannot be loaded: {error}")
        self.gmsh = gmsh
        self.gmsh.initialize(interruptible=False)
        self.gmsh.option.setNumber("General.Terminal", 0)
        self.gmsh.open(str(paths[0]))
        self.type = self.gmsh.model.mesh.getElementTypes(3)[0]
        tags, _ = self.gmsh.model.mesh.getElementsByType(self.type)
        self.order = np.argsort(tags)

    def _jacobians(self, xi):
        _, det, places = self.gmsh.model.mesh.getJacobians(self.type, (2 * xi - 1).ravel())
        det, places = (np.array(x).reshape(len(self.order), len(xi), -1) for x in (det, places))
        return places[self.order], 8 * det[self.order, :, 0]  # its elements have sides of 2

    def evaluate(self, xi):
        return self._jacobians(xi)[0]

    def determinants(self, xi):
        return self._jacobians(xi)[1]

    def field(self, name, xi):
        for tag in self.gmsh.view.getTags():
            index = self.gmsh.view.getIndex(tag)
            if self.gmsh.option.getString(f"View[{index}].Name") == name:
                _, elements, data, _, components = self.gmsh.view.getModelData(tag, 0)
        data = np.array(data).reshape(len(elements), -1, components)[np.argsort(elements)]
        _, basis, _ = self.gmsh.model.mesh.getBasisFunctions(
            self.type, (2 * xi - 1).ravel(), "Lagrange"
        )
        return np.einsum("qa,eak->eqk", np.array(basis).reshape(len(xi), -1), data)


class ByMfem:
    """MFEM, a finite element library."""

    def __init__(self, paths):
        self.mfem = pytest.importorskip("mfem.ser")
        self.mesh = self.mfem.Mesh(str(paths[0]))
        self.paths = paths

    def _rule(self, xi):
        rule = self.mfem.IntegrationRule(len(xi))
        for q, at in enumerate(xi.tolist()):
            rule.IntPoint(q).Set3(*at)
        return rule

    def _each(self, xi, ask):
        rule = self._rule(xi)
        return np.stack(
            [ask(self.mesh.GetElementTransformation(e), rule) for e in range(self.mesh.GetNE())]
        )

    def evaluate(self, xi):
        def places(transformation, rule):
            out = self.mfem.DenseMatrix()
            transformation.Transform(rule, out)
            return out.GetDataArray().T.reshape(-1, 3)

        return self._each(xi, places)

    def determinants(self, xi):
        def weights(transformation, rule):
            out = []
            for q in range(len(xi)):
                transformation.SetIntPoint(rule.IntPoint(q))
                out.append(transformation.Weight())
            return out

        return self._each(xi, weights)

    def field(self, name, xi):
        path = next(path for path in self.paths if path.stem.endswith(f"-{name}"))
        function, rule = self.mfem.GridFunction(self.mesh, str(path)), self._rule(xi)
        size = function.VectorDim()

        def values(element):
            out = []
            for q in range(len(xi)):
                value = self.mfem.Vector(size)
                function.GetVectorValue(element, rule.IntPoint(q), value)
                out.append(value.GetDataArray().copy())
            return out

        return np.array([values(e) for e in range(self.mesh.GetNE())])


READERS = [
    ("exf", ByZinc),
    ("ex1", ByZinc),
    ("fieldml", ByZinc),
    ("vtu", ByVtk),
    ("vtu-bezier", ByVtk),
    ("vtk", ByVtk),
    ("msh", ByGmsh),
    ("mfem", ByMfem),
]

each_reader = pytest.mark.parametrize(
    ("form", "reader"), READERS, ids=[f"{form}-{reader.__name__}" for form, reader in READERS]
)


@pytest.fixture(autouse=True)
def gmsh_ends():
    yield
    gmsh = sys.modules.get("gmsh")
    if gmsh is not None and gmsh.isInitialized():
        gmsh.finalize()


def written(mesh: HexMesh, folder, form, fields=()):
    return write_mesh(mesh, folder / file_name("mesh", form), fields, form).files


@pytest.mark.slow
@each_reader
def test_places_and_volume_are_ours(based, tmp_path, form, reader):
    reading = reader(written(based, tmp_path, form))
    xi = np.random.default_rng(0).random((100, 3))
    assert_allclose(reading.evaluate(xi), based.evaluate(xi), rtol=0, atol=CLOSE)
    xi, weights = gauss_cube((EXACT,) * 3)
    assert np.sum(reading.determinants(xi) @ weights) == pytest.approx(volume(based), rel=1e-6)


@pytest.mark.slow
@each_reader
def test_fields_are_ours(heart, tmp_path, form, reader):
    n, around = heart.n_elements, heart.topology.index[:, 1].max() + 1
    grid = np.stack(np.meshgrid(*[np.arange(4) / 3] * 3, indexing="ij"), -1)
    xi = grid.transpose(2, 1, 0, 3).reshape(64, 3)
    turn = (heart.topology.index[:, 1, None] + xi[None, :, 0]) / around  # jumps from 1 to 0
    fields = [
        MeshField("turn", turn[..., None]),
        MeshField("place", heart.lagrange_points()),
        MeshField("segment", 1.0 + np.arange(n) % 17),
    ]
    reading = reader(written(heart, tmp_path, form, fields))
    at = np.random.default_rng(1).random((5, 3))
    for field in fields:
        assert_allclose(
            reading.field(field.name, at),
            field.evaluate(at),
            rtol=0,
            atol=CLOSE,
            err_msg=field.name,
        )


def test_every_exact_format_has_a_foreign_reader():
    exact = {name for name, each in FORMATS.items() if each.exact}
    assert exact == {form for form, _ in READERS}


@pytest.mark.slow
def test_a_finite_element_library_finds_our_volume_in_its_mass_matrix(heart, tmp_path):
    mfem = pytest.importorskip("mfem.ser")
    mesh = mfem.Mesh(str(written(heart, tmp_path, "mfem")[0]))
    space = mfem.FiniteElementSpace(mesh, mfem.H1_FECollection(3, 3))
    form = mfem.BilinearForm(space)
    one = mfem.ConstantCoefficient(1.0)
    form.AddDomainIntegrator(mfem.MassIntegrator(one))
    form.Assemble()
    form.Finalize()
    ones, row_sums = mfem.Vector(space.GetVSize()), mfem.Vector(space.GetVSize())
    ones.Assign(1.0)
    form.SpMat().Mult(ones, row_sums)
    assert row_sums.GetDataArray().sum() == pytest.approx(volume(heart), rel=1e-9)
    named = set(heart.topology.surfaces)
    assert mesh.GetNBE() == sum(len(heart.topology.surfaces[name]) for name in named)


@pytest.mark.slow
def test_meshio_reads_the_gmsh_file_with_all_fields(heart, tmp_path):
    meshio = pytest.importorskip("meshio")
    (path,) = written(heart, tmp_path, "msh", make_fields(heart))
    found = meshio.read(path)
    named = heart.topology.surfaces
    assert [(block.type, len(block)) for block in found.cells] == [
        ("hexahedron64", heart.n_elements),
        ("quad16", sum(len(faces) for faces in named.values())),
    ]
    assert set(found.field_data) >= set(named)
    corners = found.points[found.cells[0].data[:, 0]]
    assert_allclose(corners, heart.evaluate(np.zeros((1, 3)))[:, 0], rtol=0, atol=CLOSE)
