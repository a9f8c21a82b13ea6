"""Distance of a module's mapping from a matrix: the projective 3 x 4 matrix that fits it best, and its error."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import least_squares

from lfssao.errors import InputError
from lfssao.optics.display import Display
from lfssao.optics.kernels.display import VALID
from lfssao.optics.view import WorldToImage

Points = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MatrixFit:
    """A matrix in place of a mapping."""

    matrix: NDArray[np.float64]  # (3, 4) float64: (u w, v w, w) = matrix (x, y, z, 1), of Frobenius norm 1
    points: Points  # (n, 3) float64: the points that it was fitted to
    image: NDArray[np.float64]  # (n, 2) float64: their images by the mapping, texels
    fitted: NDArray[np.float64]  # (n, 2) float64: their images by the matrix, texels

    @property
    def distance(self) -> NDArray[np.float64]:
        """Distance of the two images of each point, texels, (n,)."""
        return np.asarray(np.hypot(*(self.fitted - self.image).T))

    @property
    def rmse(self) -> float:
        """Root mean square of ``distance``, texels."""
        return float(np.sqrt(np.mean(self.distance**2)))


def best_matrix(world_to_image: WorldToImage, points: Points) -> MatrixFit:
    """Return the matrix with the least sum of squared distances in the image.

    Points are (n, 3), in general position; those outside the mapping's domain are left out. InputError if fewer than 6
    are in it.
    """
    image = world_to_image(points)[:, :2]
    kept = np.isfinite(image).all(axis=1)
    points = points[kept]
    image = image[kept]
    if len(points) < 6:
        raise InputError(f"a matrix is fitted to at least 6 points, and {len(points)} are in the mapping's domain")
    # Both sides about 1 in size: else the equations of texels and metres are badly conditioned.
    middle = image.mean(axis=0)
    size = float(np.abs(image - image.mean(axis=0)).max()) or 1.0
    aim = (image - middle) / size
    rows = np.hstack([points, np.ones((len(points), 1))])

    def error(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((_project(matrix.reshape(3, 4), rows) - aim).T.ravel())

    def slope(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
        third = matrix.reshape(3, 4)[2]
        return _equations(rows / (rows @ third)[:, None], _project(matrix.reshape(3, 4), rows))

    # Least squares of u w - m_1 X = 0, v w - m_2 X = 0 is a start near the least distances.
    start = np.linalg.svd(_equations(rows, aim), full_matrices=False)[2][-1]
    found = least_squares(error, start, slope, method="lm", ftol=1e-15, xtol=1e-15, gtol=1e-15).x.reshape(3, 4)
    whole = np.array([[size, 0.0, middle[0]], [0.0, size, middle[1]], [0.0, 0.0, 1.0]]) @ found
    return MatrixFit(whole / np.linalg.norm(whole), points, image, _project(found, rows) * size + middle)


def _project(matrix: NDArray[np.float64], rows: NDArray[np.float64]) -> NDArray[np.float64]:
    image = rows @ matrix.T
    return np.asarray(image[:, :2] / image[:, 2:])


def _equations(rows: NDArray[np.float64], image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows (X, 0, -u X) and (0, X, -v X), which a matrix's numbers multiply."""
    none = np.zeros_like(rows)
    u, v = image.T[:, :, None]
    return np.vstack([np.hstack([rows, none, -u * rows]), np.hstack([none, rows, -v * rows])])


def roi_lattice(display: Display, steps: tuple[int, int, int] = (13, 7, 5)) -> Points:
    """Return a lattice of physical points that fills the region of interest, (n, 3) float64, metres."""
    axes = [np.linspace(low, high, count) for low, high, count in zip(*display.roi, steps, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def matrix_fits(display: Display) -> list[MatrixFit]:
    """Return the best matrix of each module, over the part of the region of interest that it sees, in metres."""
    fits = []
    points = roi_lattice(display)
    world = np.eye(3, 4)
    for k in range(len(display.modules)):
        seen = display.physical_to_image(k, points)[1] == VALID
        fits.append(best_matrix(display.view(k, world).world_to_image, points[seen]))
    return fits


def draw_matrix_fits(display: Display, fits: list[MatrixFit], index: int) -> Figure:
    """Return a figure of one module's points and their images by its best matrix, and of the errors of all modules.

    The fits are ``matrix_fits`` of the display; index is the module of the left panel.
    """
    figure = Figure(figsize=(11, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
    _draw_points(left, display, fits[index], index)
    x = [m.x for m in display.modules]
    right.semilogy(x, [f.distance.max() for f in fits], "o-", markersize=4, label="largest")
    right.semilogy(x, [f.rmse for f in fits], "s-", markersize=4, label="root mean square")
    right.axhline(1.0, color="gray", linewidth=0.8, linestyle="--")
    right.annotate("one texel", (x[0], 1.0), (0, 3), textcoords="offset points", color="gray", fontsize="small")
    right.set(title="error of the best matrix", xlabel="x of the module, metres", ylabel="texels", ylim=(0.5, None))
    right.legend()
    return figure


def _draw_points(axes: Any, display: Display, fit: MatrixFit, index: int) -> None:
    module = display.modules[index]
    near = display.roi[0][2]
    far = display.roi[1][2]
    depth = (fit.points[:, 2] - near) / (far - near)
    axes.scatter(*fit.image.T, s=14, c=depth, cmap="coolwarm", label="mapping (red: far, blue: near)")
    away = fit.fitted - fit.image
    axes.quiver(*fit.image.T, *away.T, angles="xy", scale_units="xy", scale=1, width=0.002, label="to the best matrix")
    axes.plot([0, module.width, module.width, 0, 0], [0, 0, module.height, module.height, 0], color="black", lw=1)
    axes.set(aspect="equal", title=f"module {index}, points of the region of interest")
    axes.set(xlabel="u, texels", ylabel="v, texels")
    axes.invert_yaxis()
    axes.legend(fontsize="x-small", loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=2)
