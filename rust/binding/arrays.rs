//! numpy arrays as slices. Strict: dtype and number of axes are checked by the argument's type, order and size here.

use bytemuck::AnyBitPattern;
use numpy::ndarray::Dimension;
use numpy::{Element, PyReadonlyArray, PyUntypedArrayMethods};
use pyo3::PyResult;
use pyo3::exceptions::PyValueError;

/// The array's values in C order. A Fortran-ordered array is refused: `as_slice` alone would scramble it.
pub fn slice<'a, T: Element, D: Dimension>(name: &str, array: &'a PyReadonlyArray<'_, T, D>) -> PyResult<&'a [T]> {
    if !array.is_c_contiguous() {
        return Err(PyValueError::new_err(format!("{name}: want a C-contiguous array")));
    }
    Ok(array.as_slice()?)
}

/// The array's values in C order, taken together as points, pairs or matrices.
pub fn grouped<'a, T, U, D>(name: &str, array: &'a PyReadonlyArray<'_, T, D>) -> PyResult<&'a [U]>
where
    T: Element + bytemuck::NoUninit,
    U: AnyBitPattern,
    D: Dimension,
{
    let values = slice(name, array)?;
    bytemuck::try_cast_slice(values)
        .map_err(|_| PyValueError::new_err(format!("{name}: {} values do not form whole groups", values.len())))
}
