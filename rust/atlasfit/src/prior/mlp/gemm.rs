//! Matrix products of row-major f32 slices on one thread, through nalgebra (which hands them to matrixmultiply's vector kernels).
//!
//! Callers split work into blocks of fixed size and run those in parallel, so that sums do not depend on the number of threads.

use nalgebra::{Dyn, MatrixView, MatrixViewMut};

/// A row-major matrix, or the transpose of one.
#[derive(Clone, Copy)]
pub struct Mat<'a> {
    data: &'a [f32],
    shape: [usize; 2],
    strides: [usize; 2],
}

impl<'a> Mat<'a> {
    /// A row-major matrix with `columns` columns.
    pub fn new(data: &'a [f32], columns: usize) -> Self {
        Self { data, shape: [data.len() / columns, columns], strides: [columns, 1] }
    }
    /// The transpose.
    pub fn t(self) -> Self {
        Self { shape: [self.shape[1], self.shape[0]], strides: [self.strides[1], self.strides[0]], ..self }
    }
    fn view(&self) -> MatrixView<'a, f32, Dyn, Dyn, Dyn, Dyn> {
        let ([r, c], [rs, cs]) = (self.shape, self.strides);
        MatrixView::from_slice_with_strides_generic(self.data, Dyn(r), Dyn(c), Dyn(rs), Dyn(cs))
    }
}

/// c = a b, or c += a b where `add`.
pub fn gemm(c: &mut [f32], a: Mat<'_>, b: Mat<'_>, add: bool) {
    let (rows, columns) = (a.shape[0], b.shape[1]);
    let mut c =
        MatrixViewMut::from_slice_with_strides_generic(c, Dyn(rows), Dyn(columns), Dyn(columns), Dyn(1));
    c.gemm(1.0, &a.view(), &b.view(), f32::from(u8::from(add)));
}
