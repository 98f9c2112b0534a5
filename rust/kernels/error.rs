//! What a kernel can refuse. Kernels never panic: every refusal is a value that the binding turns into an exception.

use thiserror::Error;

/// Why a kernel did not run to its end. Arguments are named as the caller knows them.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum KernelError {
    /// A buffer does not hold as many values as its sizes say.
    #[error("{argument}: want {wanted} values, got {got}")]
    Length {
        /// The argument's public name.
        argument: &'static str,
        /// How many values the sizes ask for.
        wanted: usize,
        /// How many values there are.
        got: usize,
    },
    /// A value at one pixel is not allowed there.
    #[error("{argument}: {problem} at row {row}, column {column}")]
    Pixel {
        /// The argument's public name.
        argument: &'static str,
        /// What is wrong with the value.
        problem: &'static str,
        /// The pixel's row.
        row: usize,
        /// The pixel's column.
        column: usize,
    },
    /// A value in a list is not allowed.
    #[error("{argument}: {problem} at index {index}")]
    Item {
        /// The argument's public name.
        argument: &'static str,
        /// What is wrong with the value.
        problem: &'static str,
        /// Where it stands.
        index: usize,
    },
    /// An option or a combination of sizes is not allowed.
    #[error("{argument}: {problem}")]
    Argument {
        /// The argument's public name.
        argument: &'static str,
        /// What is wrong with it.
        problem: &'static str,
    },
}

/// Refuses a buffer whose length is not `wanted`.
pub fn check_length(argument: &'static str, wanted: usize, got: usize) -> Result<(), KernelError> {
    if wanted == got { Ok(()) } else { Err(KernelError::Length { argument, wanted, got }) }
}
