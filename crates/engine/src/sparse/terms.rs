//! A tensor whose every element is a short weighted sum of elements of another.

use tract_onnx::tract_core::internal::{TVec, Tensor};

/// The most terms of one map (8 bytes each). A chain with more is left as it is in the graph.
const TERMS_MAX: usize = 1 << 22;

/// Element `e`, row-major, is the sum over `e degree .. (e + 1) degree` of
/// `weight[t] source[index[t]]`.
#[derive(Clone, Debug)]
pub(super) struct Terms {
    pub(super) shape: TVec<usize>,
    pub(super) degree: usize,
    pub(super) index: Vec<u32>,
    pub(super) weight: Vec<f32>,
}

impl Terms {
    /// Each element is the source's element at the same place.
    pub(super) fn source(shape: &[usize]) -> Option<Self> {
        let len = u32::try_from(product(shape)?).ok()?;
        let index: Vec<_> = (0..len).collect();
        let weight = vec![1.0; index.len()];
        Some(Self { shape: shape.into(), degree: 1, index, weight })
    }

    /// Picks elements along `axis`, as ONNX' `Gather` does.
    pub(super) fn gather(&self, axis: usize, picked: &[usize], indices: &[i64]) -> Option<Self> {
        let (before, len, after) = self.around(axis)?;
        let shape: TVec<usize> =
            [&self.shape[..axis], picked, &self.shape[axis + 1..]].concat().into();
        let mut terms = self.empty(shape, self.degree)?;
        for outer in 0..before {
            for &picks in indices {
                // Negative indices count from the end.
                let at =
                    usize::try_from(if picks < 0 { picks + len as i64 } else { picks }).ok()?;
                if at >= len {
                    return None;
                }
                let first = (outer * len + at) * after * self.degree;
                terms.append(self, first, after * self.degree)?;
            }
        }
        Some(terms)
    }

    /// Multiplies the elements by those of a constant, whose axes of length 1 are repeated.
    pub(super) fn scale(&self, factor: &Tensor) -> Option<Self> {
        let plain = factor.try_as_plain_ram().ok()?;
        let factors = plain.as_slice::<f32>().ok()?;
        if factor.shape().len() != self.shape.len() {
            return None;
        }
        let fits = |(&own, &of): (&usize, &usize)| own == of || of == 1;
        if !self.shape.iter().zip(factor.shape()).all(fits) {
            return None;
        }
        let mut terms = self.clone();
        for (element, weights) in terms.weight.chunks_exact_mut(self.degree).enumerate() {
            let by = *factors.get(repeated(element, &self.shape, factor.shape()))?;
            weights.iter_mut().for_each(|weight| *weight *= by);
        }
        Some(terms)
    }

    /// Sums along `axis`, which is kept with length 1.
    pub(super) fn sum(&self, axis: usize) -> Option<Self> {
        let (before, len, after) = self.around(axis)?;
        let mut shape = self.shape.clone();
        shape[axis] = 1;
        let mut terms = self.empty(shape, self.degree.checked_mul(len)?)?;
        for outer in 0..before {
            for inner in 0..after {
                for at in 0..len {
                    let first = ((outer * len + at) * after + inner) * self.degree;
                    terms.append(self, first, self.degree)?;
                }
            }
        }
        Some(terms)
    }

    /// The same elements in another shape.
    pub(super) fn reshape(&self, shape: &[usize]) -> Option<Self> {
        let same = product(shape)? == product(&self.shape)?;
        same.then(|| Self { shape: shape.into(), ..self.clone() })
    }

    /// Numbers of elements before, along and after an axis: the products of these lengths.
    fn around(&self, axis: usize) -> Option<(usize, usize, usize)> {
        let len = *self.shape.get(axis)?;
        Some((product(&self.shape[..axis])?, len, product(&self.shape[axis + 1..])?))
    }

    fn empty(&self, shape: TVec<usize>, degree: usize) -> Option<Self> {
        let terms = product(&shape)?.checked_mul(degree)?;
        let (index, weight) = (Vec::with_capacity(terms), Vec::with_capacity(terms));
        (degree > 0 && terms <= TERMS_MAX).then_some(Self { shape, degree, index, weight })
    }

    fn append(&mut self, from: &Self, first: usize, count: usize) -> Option<()> {
        self.index.extend(from.index.get(first..first + count)?);
        self.weight.extend(from.weight.get(first..first + count)?);
        Some(())
    }
}

/// Number of elements of a shape; None if it is above [`TERMS_MAX`].
fn product(shape: &[usize]) -> Option<usize> {
    let len = shape.iter().try_fold(1_usize, |len, &along| len.checked_mul(along))?;
    (len <= TERMS_MAX).then_some(len)
}

/// The place, in a tensor of shape `of` that is broadcast to `shape`, of the value for `element`.
fn repeated(element: usize, shape: &[usize], of: &[usize]) -> usize {
    let (mut rest, mut place, mut stride) = (element, 0, 1);
    for (&along, &of) in shape.iter().zip(of).rev() {
        let at = rest % along;
        rest /= along;
        place += if of == 1 { 0 } else { at * stride };
        stride *= of;
    }
    place
}
