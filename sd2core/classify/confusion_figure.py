"""Figure of confusion matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def confusion_figure(
    matrices: Sequence[NDArray[np.float64]],
    classes: Sequence[str],
    titles: Sequence[str],
    heading: str,
) -> Figure:
    """Draw row-normalised confusion matrices in a row or two, bound to no window.

    Parameters
    ----------
    matrices : sequence of float64 ndarray, (classes, classes)
        True classes by found ones, see :func:`~sd2core.classify.metrics.shares`; NaN is drawn as a
        dash.
    classes : sequence of str
        Names of rows and columns.
    titles : sequence of str
        One for each matrix.
    heading : str
        Title of the figure.
    """
    from matplotlib.figure import Figure

    columns = min(len(matrices), 3)
    lines = -(-len(matrices) // columns)
    figure = Figure(figsize=(3.4 * columns + 0.6, 3.2 * lines + 0.6), dpi=120, layout="constrained")
    all_axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, matrix, title in zip(all_axes, matrices, titles, strict=False):
        _matrix(axes, matrix, classes)
        axes.set_title(title, fontsize=9)
    for axes in all_axes[len(matrices) :]:
        axes.axis("off")
    figure.suptitle(heading, fontsize=10)
    return figure


def _matrix(axes: Axes, matrix: NDArray[np.float64], classes: Sequence[str]) -> None:
    axes.imshow(np.nan_to_num(matrix), vmin=0.0, vmax=1.0, cmap="Blues")
    places = range(len(classes))
    for row in places:
        for column in places:
            value = matrix[row, column]
            axes.text(
                column,
                row,
                "–" if np.isnan(value) else f"{100 * value:.0f} %",
                ha="center",
                va="center",
                color="white" if value > 0.55 else "black",
                fontsize=9,
            )
    axes.set_xticks(places, classes, fontsize=8, rotation=20, ha="right")
    axes.set_yticks(places, classes, fontsize=8)
    axes.set_xlabel("taken for", fontsize=8)
    axes.set_ylabel("true", fontsize=8)
