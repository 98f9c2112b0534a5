"""Slow numpy transcription of the 2007 paper's section 5, with the losses and priors that docs/papers.md adds."""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

LOSSES = {
    "squared": lambda e: e**2,
    "huber": lambda e: np.where(e <= 1, e**2, 2 * e - 1),
    "cauchy": lambda e: np.log1p(e**2),
    "geman_mcclure": lambda e: e**2 / (1 + e**2),
}


def camera_matrix(unknowns, image_size):
    """Equations 1-2 in y-down pixels: ln f, a rotation vector and the camera's centre to K R [Id | -C]."""
    rotation, center = Rotation.from_rotvec(unknowns[1:4]).as_matrix(), unknowns[4:]
    focal, (width, height) = np.exp(unknowns[0]), image_size
    intrinsic = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    return intrinsic @ rotation @ np.column_stack([np.eye(3), -center])


def unknowns_of(camera):
    """The seven unknowns of a PerspectiveCamera."""
    turn = Rotation.from_matrix(camera.rotation).as_rotvec()
    return np.concatenate([[np.log(camera.focal_length)], turn, camera.position])


def start(points, azimuth, image_size, field_of_view):
    """Equation 3: a camera five diagonals away that looks at the middle of the points, here in any direction."""
    center, diagonal = points.mean(axis=0), np.linalg.norm(np.ptp(points, axis=0))
    sin, cos = np.sin(azimuth), np.cos(azimuth)
    rotation = np.array([[cos, 0, -sin], [0, -1, 0], [-sin, 0, -cos]])
    focal = image_size[0] / 2 / np.tan(field_of_view / 2)
    turn = Rotation.from_matrix(rotation).as_rotvec()
    return np.concatenate([[np.log(focal)], turn, center + 5 * diagonal * np.array([sin, 0, cos])])


def residuals(unknowns, joints, points, image_size, *, loss, scale, usual, spreads):
    """What is squared and summed: each mark's loss, then focal length, roll, upside down, elevation."""
    image = np.column_stack([points, np.ones(len(points))]) @ camera_matrix(unknowns, image_size).T
    distances = np.linalg.norm(image[:, :2] / image[:, 2:] - joints, axis=1)
    up = Rotation.from_rotvec(unknowns[1:4]).as_matrix()[:, 1]
    usual_focal = image_size[0] / 2 / np.tan(usual / 2)
    focal = (unknowns[0] - np.log(usual_focal)) / spreads[0]
    roll, flipped, elevation = up[0] / spreads[1], max(up[1], 0) / spreads[1], up[2] / spreads[2]
    return np.concatenate([np.sqrt(LOSSES[loss](distances / scale)), [focal, roll, flipped, elevation]])


def fit(unknowns, joints, points, image_size, **options):
    """The seven unknowns and the cost where scipy's Levenberg-Marquardt stops."""
    arguments = (joints, points, image_size)
    found = least_squares(residuals, unknowns, args=arguments, kwargs=options, method="lm", max_nfev=400)
    return found.x, 2 * found.cost
