//! Wrapper of `kernels/gif.rs`.

use crate::arrays::slice;
use crate::errors::to_python;
use numpy::{PyReadonlyArray1, PyReadonlyArray4, PyReadwriteArray2, PyUntypedArrayMethods};
use pegbar_kernels::gif;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

type Packed<'py> = ([usize; 4], Bound<'py, PyBytes>);

#[pyfunction]
#[pyo3(signature = (frames, table, previous))]
pub fn pack_gif_frames<'py>(
    py: Python<'py>,
    frames: PyReadonlyArray4<'py, u8>,
    table: PyReadonlyArray1<'py, u8>,
    previous: Option<PyReadwriteArray2<'py, u8>>,
) -> PyResult<Vec<Packed<'py>>> {
    let [height, width, channels] = [frames.shape()[1], frames.shape()[2], frames.shape()[3]];
    let (pixels, entries) = (slice("frames", &frames)?, slice("table", &table)?);
    let mut previous = previous;
    let before = previous.as_mut().map(|array| array.as_slice_mut()).transpose()?;
    let packed = py.detach(|| gif::pack_frames(pixels, channels, width, height, entries, before)).map_err(to_python)?;
    Ok(packed.into_iter().map(|frame| (frame.place, PyBytes::new(py, &frame.data))).collect())
}
