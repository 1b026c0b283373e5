"""Other registration tools on the task of ours: each gives the map from template to patient.

Fixed image: the template, voxels 0 and 1. Moving image: the patient's myocardium. The transform of
a tool then maps points of the template to the patient, which is what carries a mesh. Settings are
those that the tools' own documentation recommends for such images, at three resolutions.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.ndimage as ndi
import SimpleITK as sitk  # noqa: N813 - its documented short name
from numpy.typing import NDArray

Array = NDArray[np.float64]
Answer = tuple[float, Array]
"""Seconds of the registration alone, and the moved points (n, 3), mm, LPS."""

GREEDY_ITERATIONS = "100x50x10"
"""Of each resolution, coarse to fine, as in greedy's own examples; metric SSD, kernels default."""

NODE_SPACING = 10.0
"""Of the B-splines' control points at the finest resolution, mm."""

SHRINK, SMOOTH = (4, 2, 1), (2.0, 1.0, 0.0)
"""Voxels joined, and voxels of Gaussian smoothing, at the resolutions of SimpleITK's B-spline."""

SCALE_FACTORS = (1, 1, 1)
"""Refinement of SimpleITK's control points over the resolutions: none; 10 mm throughout."""

OPTIMIZER_STEPS = 100
TOLERANCE = 1e-5
"""Most steps of L-BFGS-B in each resolution, and gradient at which it ends, as in the examples."""

SHARE = 0.2
"""Share of the voxels at which SimpleITK's metric is taken, on a regular grid."""


def greedy(fixed: sitk.Image, moving: sitk.Image, points: Array, threads: int) -> Answer:
    """picsl-greedy: diffeomorphic, sum of squared differences."""
    from picsl_greedy import Greedy3D

    tool = Greedy3D()
    start = time.perf_counter()
    tool.execute(
        f"-d 3 -i fixed moving -o warp -m SSD -n {GREEDY_ITERATIONS} -threads {threads} -V 0",
        fixed=fixed,
        moving=moving,
        warp=None,
    )
    seconds = time.perf_counter() - start
    return seconds, points + sample_field(tool["warp"], points)


def simpleitk(fixed: sitk.Image, moving: sitk.Image, points: Array, threads: int) -> Answer:
    """SimpleITK's B-spline, mean squares, L-BFGS-B."""
    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(threads)
    extent = np.array(fixed.GetSize()) * fixed.GetSpacing()
    cells = [int(n) for n in np.ceil(extent / NODE_SPACING)]
    start = time.perf_counter()
    method = sitk.ImageRegistrationMethod()
    method.SetMetricAsMeanSquares()
    method.SetMetricSamplingStrategy(method.REGULAR)
    method.SetMetricSamplingPercentage(SHARE)
    method.SetInterpolator(sitk.sitkLinear)
    method.SetOptimizerAsLBFGSB(TOLERANCE, OPTIMIZER_STEPS)
    method.SetShrinkFactorsPerLevel(SHRINK)
    method.SetSmoothingSigmasPerLevel(SMOOTH)
    transform = sitk.BSplineTransformInitializer(fixed, cells)
    method.SetInitialTransformAsBSpline(transform, inPlace=True, scaleFactors=SCALE_FACTORS)
    found = method.Execute(fixed, moving)
    seconds = time.perf_counter() - start
    return seconds, np.array([found.TransformPoint(p) for p in points.tolist()])


def elastix(fixed: sitk.Image, moving: sitk.Image, points: Array, threads: int) -> Answer:
    """itk-elastix: B-spline, mean squares, stochastic gradient descent, its default settings."""
    import itk

    itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(threads)
    images = [_to_itk(image) for image in (fixed, moving)]
    parameters = itk.ParameterObject.New()
    settings = parameters.GetDefaultParameterMap("bspline", len(SHRINK), NODE_SPACING)
    # A bending penalty beside the metric crashes version 0.25.4 with more than one thread.
    settings["Registration"] = ("MultiResolutionRegistration",)
    settings["Metric"] = ("AdvancedMeanSquares",)
    settings["WriteResultImage"] = ("false",)
    parameters.AddParameterMap(settings)
    start = time.perf_counter()
    _, found = itk.elastix_registration_method(
        *images, parameter_object=parameters, number_of_threads=threads, log_to_console=False
    )
    seconds = time.perf_counter() - start
    with tempfile.TemporaryDirectory() as folder:
        field = itk.transformix_deformation_field(images[1], found, output_directory=folder)
    displacement = sitk.GetImageFromArray(np.asarray(field), isVector=True)
    displacement.SetSpacing(list(field.GetSpacing()))
    displacement.SetOrigin(list(field.GetOrigin()))
    displacement.SetDirection(list(itk.array_from_matrix(field.GetDirection()).ravel()))
    return seconds, points + sample_field(displacement, points)


PEERS: dict[str, tuple[str, str, Callable[[sitk.Image, sitk.Image, Array, int], Answer]]] = {
    "picsl-greedy": ("picsl_greedy", "picsl_greedy", greedy),
    "SimpleITK B-spline 10 mm": ("SimpleITK", "SimpleITK", simpleitk),
    "itk-elastix B-spline 10 mm": ("itk-elastix", "itk", elastix),
}
"""Package and module that must be installed, and the function that runs it."""


def sample_field(field: sitk.Image, points: Array) -> Array:
    """Displacement (n, 3), mm, LPS, at points (n, 3), mm, LPS; trilinear, continued at borders."""
    values = sitk.GetArrayFromImage(field).astype(float)  # k, j, i, x
    direction = np.array(field.GetDirection()).reshape(3, 3)
    index = (points - field.GetOrigin()) @ direction / field.GetSpacing()
    return np.stack(
        [
            ndi.map_coordinates(values[..., x], index[:, ::-1].T, order=1, mode="nearest")
            for x in range(3)
        ],
        axis=-1,
    )


def _to_itk(image: sitk.Image) -> Any:
    """The same image for ITK's own wrapping."""
    import itk

    out = itk.image_from_array(sitk.GetArrayFromImage(image).astype(np.float32))
    out.SetSpacing(image.GetSpacing())
    out.SetOrigin(image.GetOrigin())
    out.SetDirection(itk.matrix_from_array(np.array(image.GetDirection()).reshape(3, 3)))
    return out
