"""Numba kernels of the means and contrasts along lines of a picture."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def line_means(image, down, right, out):
    """Compute the means of some pixels around each; the edges of the picture go on.

    Inputs: image (h, w) float32; down, right (n,) int64, rows and columns from a pixel to those of its mean.
    Output: out (h, w) float32.
    """
    height, width = image.shape
    part = np.float32(1.0 / len(down))
    for y in range(height):
        out[y] = 0.0
        for n in range(len(down)):
            row, shift = min(max(y + down[n], 0), height - 1), right[n]
            start = min(max(-shift, 0), width)
            stop = max(min(width - shift, width), start)
            out[y, :start] += image[row, 0]
            out[y, stop:] += image[row, width - 1]
            total, more = out[y, start:stop], image[row, start + shift : stop + shift]
            # slices, since an index that may be negative keeps loops from being vectorized
            for x in range(len(total)):
                total[x] += more[x]
        out[y] *= part


@njit(cache=True, nogil=True)
def contrasts(line, down, right, out):
    """Compute by how much lines exceed those on both sides, the lesser; of several distances the most, 0 at least.

    Inputs: line (h, w) float32, means along lines; down, right (n,) int64, rows and columns to one side at each
    distance. Output: out (h, w) float32.
    """
    height, width = line.shape
    for y in range(height):
        out[y] = 0.0
        for n in range(len(down)):
            above, below = min(max(y - down[n], 0), height - 1), max(min(y + down[n], height - 1), 0)
            for x in range(width):
                before, after = x - right[n], x + right[n]
                before, after = min(max(before, 0), width - 1), min(max(after, 0), width - 1)
                side = max(line[below, after], line[above, before])
                out[y, x] = max(out[y, x], line[y, x] - side)


@njit(cache=True, nogil=True)
def keep_strongest(contrast, long, turn, best, angle):
    """Keep the strongest evidence, the product of both means, and the direction of its line.

    Inputs: contrast, long (h, w) float32; turn, float32 [rad]. Outputs: best, angle (h, w) float32.
    """
    for y in range(len(best)):
        for x in range(best.shape[1]):
            evidence = contrast[y, x] * long[y, x]
            if evidence > best[y, x]:
                best[y, x] = evidence
                angle[y, x] = turn


@njit(cache=True, nogil=True)
def side_steps(line, down, right, out):
    """Compute the difference of the lines on both sides of each.

    Inputs: line, as for `contrasts`; down, right, int64, to one side. Output: out (h, w) float32.
    """
    height, width = line.shape
    for y in range(height):
        above, below = min(max(y - down, 0), height - 1), max(min(y + down, height - 1), 0)
        for x in range(width):
            before, after = min(max(x - right, 0), width - 1), min(max(x + right, 0), width - 1)
            out[y, x] = line[below, after] - line[above, before]
