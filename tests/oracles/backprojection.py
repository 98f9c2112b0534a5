"""Slow numpy transcription of the 2010 paper's section 3.1.3, after its printed equations."""

import numpy as np

from pegbar import PerspectiveCamera


def cross(mark):
    """Equation 3's matrix C of a normalised mark."""
    x, y = mark
    return np.array([[0, -1, y], [1, 0, -x], [-y, x, 0]])


def normalised(mark, matrix):
    """The mark and the matrix with the intrinsic K taken out."""
    camera = PerspectiveCamera(matrix, (2, 2))
    inverse = np.linalg.inv(camera.intrinsic)
    mark = inverse @ [*mark, 1]
    return mark[:2] / mark[2], inverse @ camera.matrix


def stacked(markers, matrices, depths, smoothing, unit=1e5):
    """Equations 7-8: one system for all frames and markers, homogeneous points, W on both sides.

    ``unit`` is the weight of equation 5, which stands for an exact 1.
    """
    frames, count = depths.shape
    rows, right = [], []

    def row(entries, value, weight):
        line = np.zeros((frames, count, 4))
        for place, numbers in entries:
            line[place] += numbers
        rows.append(weight * line.ravel())
        right.append(weight * value)

    for i in range(frames):
        for j in range(count):
            mark, matrix = normalised(markers[i, j], matrices[i])
            for numbers in cross(mark) @ matrix:
                row([((i, j), numbers)], 0, 1)
            row([((i, j), matrix[2])], depths[i, j], 1)
            row([((i, j), np.array([0, 0, 0, 1]))], 1, unit)
            if i + 1 < frames:
                for numbers in np.eye(4):
                    row([((i, j), numbers), ((i + 1, j), -numbers)], 0, np.sqrt(smoothing))
    answer = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0].reshape(frames, count, 4)
    return answer[..., :3] / answer[..., 3:]


def along_rays(markers, matrices, depths, seen, smoothing):
    """The depths on the rays that the default smoothing chooses, by one dense least-squares problem a marker."""
    frames, count = depths.shape
    out = np.full((frames, count, 3), np.nan)
    for j in range(count):
        cameras = [PerspectiveCamera(matrix, (2, 2)) for matrix in matrices]
        mark = np.where(seen[:, j, None], markers[:, j], 0)
        near = np.array([c.unproject(x, 0.0) for c, x in zip(cameras, mark, strict=True)])
        ray = np.array([c.unproject(x, 1.0) for c, x in zip(cameras, mark, strict=True)]) - near
        rows, right = (
            [np.eye(frames)[i] for i in range(frames)],
            [depths[i, j] if seen[i, j] else 0 for i in range(frames)],
        )
        for i in range(1, frames - 1):
            if seen[i - 1 : i + 2, j].all():
                along = ray[i] / (ray[i] @ ray[i])
                line = np.zeros(frames)
                line[i - 1 : i + 2] = ray[i - 1 : i + 2] @ along * [1, -2, 1]
                rows.append(np.sqrt(smoothing) * line)
                right.append(-np.sqrt(smoothing) * (near[i - 1 : i + 2] @ along) @ [1, -2, 1])
        z = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
        out[seen[:, j], j] = (near + z[:, None] * ray)[seen[:, j]]
    return out
