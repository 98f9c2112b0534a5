"""Slow numpy transcription of the 2009 paper's sections 3.4 and 3.5, one function per equation."""

import numpy as np


def align_limbs(projected, drawn, chains):
    """Section 3.4: each segment is rotated in the image plane until its polar angle is the drawn limb's."""
    out = np.array(projected, float)
    for frame in range(len(out)):
        for parent, child in chains:
            limb = np.subtract(projected[frame][child], projected[frame][parent])
            wanted = np.subtract(drawn[frame][child], drawn[frame][parent])
            turn = np.arctan2(wanted[1], wanted[0]) - np.arctan2(limb[1], limb[0])
            rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
            out[frame, child] = out[frame, parent] + rotation @ limb
    return out


def eq6_orthographic(markers, rotation, scale, center):
    """Rows R and values of R X = x2D, the picture's units divided by the scale."""
    count = len(markers)
    matrix, values = np.zeros((2 * count, 3 * count)), np.zeros(2 * count)
    for marker in range(count):
        matrix[2 * marker : 2 * marker + 2, 3 * marker : 3 * marker + 3] = rotation[:2]
        values[2 * marker : 2 * marker + 2] = (markers[marker] - np.asarray(center)) / scale
    return matrix, values


def eq6_perspective(markers, matrix_3x4, focal_length):
    """Rows and values of (M0 - x M2) X = 0 over the focal length: the pixel residual times depth / focal length."""
    count = len(markers)
    matrix, values = np.zeros((2 * count, 3 * count)), np.zeros(2 * count)
    for marker in range(count):
        for axis in range(2):
            row = (matrix_3x4[axis] - markers[marker][axis] * matrix_3x4[2]) / focal_length
            matrix[2 * marker + axis, 3 * marker : 3 * marker + 3] = row[:3]
            values[2 * marker + axis] = -row[3]
    return matrix, values


def eq7_squared_length(pose, limb):
    """The left side of eq. 7."""
    i, j = limb
    return sum((pose[i][axis] - pose[j][axis]) ** 2 for axis in range(3))


def eq8_limbs(prior, limbs, lengths):
    """A_limb and b_limb: eq. 7 as a first-order Taylor series around the clip's pose."""
    matrix, values = np.zeros((len(limbs), prior.size)), np.zeros(len(limbs))
    for row, ((i, j), length) in enumerate(zip(limbs, lengths, strict=True)):
        gradient = np.zeros(prior.shape)
        gradient[i] += 2 * (prior[i] - prior[j])
        gradient[j] -= 2 * (prior[i] - prior[j])
        matrix[row] = gradient.ravel()
        values[row] = length**2 - eq7_squared_length(prior, (i, j)) + gradient.ravel() @ prior.ravel()
    return matrix, values


def eq9_prior(prior):
    """Identity and the clip's pose."""
    return np.eye(prior.size), prior.ravel()


def eq10_stacked(projection, limbs, prior, limb_weight, prior_weight):
    """W A_full and W b_full; weights multiply squared residuals, so rows have their roots."""
    parts = [(1.0, projection), (limb_weight, limbs), (prior_weight, prior)]
    matrix = np.vstack([np.sqrt(weight) * rows for weight, (rows, _) in parts])
    values = np.concatenate([np.sqrt(weight) * right for weight, (_, right) in parts])
    return matrix, values


def eq11_solve(matrix, values):
    """The least-squares pose of eq. 11."""
    return np.linalg.lstsq(matrix, values, rcond=None)[0].reshape(-1, 3)


def eq12_components(training, components):
    """Mean and basis vectors (as columns) of the largest variance, at most ``components`` of them."""
    poses = np.asarray(training, float).reshape(len(training), -1)
    mean = poses.mean(axis=0)
    covariance = (poses - mean).T @ (poses - mean)
    values, vectors = np.linalg.eigh(covariance)
    order = np.argsort(values)[::-1]
    order = order[values[order] > 1e-12 * values.max()][:components]
    return mean, vectors[:, order]


def eq14_to_16_solve(matrix, values, mean, basis):
    """The pose mu + C X_b whose X_b solves W A C X_b = b - A mu."""
    weights = np.linalg.lstsq(matrix @ basis, values - matrix @ mean, rcond=None)[0]
    return (mean + basis @ weights).reshape(-1, 3)


def reconstruct(projections, prior, limbs, lengths, limb_weight, prior_weight, training=None, components=20):
    """Eqs. 5-16, frame by frame; ``projections`` holds a frame's rows and values of eq. 6."""
    poses = []
    for projection, pose in zip(projections, prior, strict=True):
        rows = eq8_limbs(pose, limbs, lengths)
        matrix, values = eq10_stacked(projection, rows, eq9_prior(pose), limb_weight, prior_weight)
        if training is None:
            poses.append(eq11_solve(matrix, values))
        else:
            poses.append(eq14_to_16_solve(matrix, values, *eq12_components(training, components)))
    return np.array(poses)
