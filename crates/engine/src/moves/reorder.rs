//! Values in another order, as an operator of tract.

use pulp::{Arch, NullaryFnOnce};
use tract_onnx::tract_core::internal::*;

/// The most loops around the two innermost.
const OUTER_MAX: usize = 6;

/// One loop over the values to be written: the number of turns, and the distance in the source from
/// one to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Loop {
    count: usize,
    stride: usize,
}

/// Writes, one after the other, the values that a nest of loops reads.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Reorder {
    shape: TVec<usize>,
    /// The two innermost loops, the innermost first.
    tile: [Loop; 2],
    outer: Vec<Loop>,
}

impl Reorder {
    /// `index` gives the place in the source of each value in turn. None: no nest of loops reads in
    /// this order.
    pub(super) fn new(shape: TVec<usize>, index: &[u32]) -> Option<Self> {
        let at = |k: usize| index.get(k).map(|&at| at as usize);
        let mut loops = Vec::new();
        let mut span = 1;
        while span < index.len() {
            let stride = at(span)?;
            let count = (1..).find(|count| at(count * span) != Some(count * stride))?;
            if count == 1 {
                return None;
            }
            loops.push(Loop { count, stride });
            span *= count;
        }
        if span != index.len() {
            return None;
        }
        loops.resize(loops.len().max(2), Loop { count: 1, stride: 1 });
        let read = |k: usize| {
            let (_, read) = loops.iter().fold((k, 0), |(k, read), step| {
                (k / step.count, read + k % step.count * step.stride)
            });
            read
        };
        if loops.len() > 2 + OUTER_MAX || (0..span).any(|k| at(k) != Some(read(k))) {
            return None;
        }
        let outer = loops.split_off(2);
        Some(Self { shape, tile: [loops[0], loops[1]], outer })
    }
}

struct Work<'a> {
    order: &'a Reorder,
    source: &'a [f32],
    target: &'a mut [f32],
}

impl NullaryFnOnce for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Reorder { tile, outer, .. } = self.order;
        let (mut turns, mut first) = ([0; OUTER_MAX], 0);
        for target in self.target.chunks_exact_mut(tile[0].count * tile[1].count) {
            write(*tile, &self.source[first..], target);
            // Advances the innermost loop that has not ended, and restarts those within it.
            for (turn, step) in turns.iter_mut().zip(outer) {
                *turn += 1;
                first += step.stride;
                if *turn < step.count {
                    break;
                }
                first -= step.count * step.stride;
                *turn = 0;
            }
        }
    }
}

#[inline(always)]
fn write([row, rows]: [Loop; 2], source: &[f32], target: &mut [f32]) {
    if row.count == 2 && rows.stride == 1 {
        let (even, odd) = (&source[..rows.count], &source[row.stride..][..rows.count]);
        for ((pair, even), odd) in target.chunks_exact_mut(2).zip(even).zip(odd) {
            pair.copy_from_slice(&[*even, *odd]);
        }
        return;
    }
    for (k, target) in target.chunks_exact_mut(row.count).enumerate() {
        let source = &source[k * rows.stride..][..(row.count - 1) * row.stride + 1];
        match row.stride {
            1 => target.copy_from_slice(source),
            2 => {
                let (last, target) = target.split_last_mut().expect("a loop has a turn");
                for (value, pair) in target.iter_mut().zip(source.chunks_exact(2)) {
                    *value = pair[0];
                }
                *last = source[source.len() - 1];
            }
            stride => {
                target.iter_mut().zip(source.iter().step_by(stride)).for_each(|(t, s)| *t = *s);
            }
        }
    }
}

impl Op for Reorder {
    fn name(&self) -> StaticName {
        "Reorder".into()
    }

    op_as_typed_op!();
}

impl EvalOp for Reorder {
    op_out_of_plan!();

    fn eval(&self, _: &EvalContext<'_>, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        let source = args_1!(inputs);
        let source = source.try_as_plain_ram()?;
        let mut target = Tensor::zero::<f32>(&self.shape)?;
        let mut values = target.try_as_plain_ram_mut()?;
        let (source, target_values) = (source.as_slice::<f32>()?, values.as_slice_mut::<f32>()?);
        Arch::new().dispatch(Work { order: self, source, target: target_values });
        Ok(tvec!(target.into_tvalue()))
    }
}

impl TypedOp for Reorder {
    as_op!();

    fn output_facts(&self, _: &[&TypedFact]) -> TractResult<TVec<TypedFact>> {
        Ok(tvec!(f32::fact(&*self.shape)))
    }
}
