"""The paper's routine for a limb's boundary, one pixel after the other."""


def first_boundary(gray, start, direction, threshold=128):
    """Steps from `start` to the first dark pixel along the unit `direction`."""
    for step in range(1000):
        column, row = (round(float(value)) for value in start + step * direction)
        if gray[row, column] < threshold:
            return step
    return None
