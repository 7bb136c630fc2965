//! Finds networks on maps in a graph, operator by operator, and takes their constants.
//!
//! If a single operator differs, the graph is not such a network, and tract runs it as it stands.

use super::graph::{Graph, attribute, inputs};
use super::parts::{CorrectionParts, LevelParts, Parts};
use super::upsampling::{NEXT, OWN};
use crate::{INPUT_NAME, MAP_LEN, MAP_SIDE_PX};
use tract_onnx::pb::ModelProto;

/// Number of pixels in a block.
const BLOCK: usize = 4;
/// Blocks in a row or a column of the finest level.
const FINEST_SIDE: usize = MAP_SIDE_PX / 2;
/// Greatest width of a convolution, blocks.
const KERNEL_MAX: usize = 31;
/// The most members of a mean. Members may share constants, so without a limit a small file could
/// ask for much memory.
const MEMBERS_MAX: usize = 8;
/// The most levels.
const LEVELS_MAX: usize = 6;
/// Greatest relative difference, by rounding, between a weight and the product of mix and
/// interpolation.
const ROUNDING: f32 = 1e-6;

/// The networks whose sum is the answer of the graph: one network, or the members of a mean.
pub(super) fn find(model: &ModelProto) -> Option<Vec<Parts>> {
    let graph = Graph::new(model)?;
    if let Some(parts) = network(&graph, graph.output) {
        return Some(vec![parts]);
    }
    let (mut sum, factor) = graph.scaled(graph.output)?;
    let mut networks = Vec::new();
    while let Some([rest, last]) = graph.inputs(sum, "Add") {
        networks.push(network(&graph, last)?);
        if networks.len() == MEMBERS_MAX {
            return None;
        }
        sum = rest;
    }
    networks.push(network(&graph, sum)?);
    for network in &mut networks {
        network.mask.iter_mut().for_each(|mask| *mask *= factor);
    }
    Some(networks)
}

/// The network whose output this is: densities, times their unit, times a mask.
fn network(graph: &Graph<'_>, name: &str) -> Option<Parts> {
    let [sed, mask] = graph.inputs(name, "Mul")?;
    let (shape, mut mask) = graph.shaped::<4>(mask)?;
    let (sed, unit) = graph.scaled(sed)?;
    if shape != [1, 1, MAP_SIDE_PX, MAP_SIDE_PX] {
        return None;
    }
    mask.iter_mut().for_each(|mask| *mask *= unit);
    let node = graph.node(graph.shuffled(sed)?, "ReduceSum")?;
    let [squares, axes] = inputs(node)?;
    if graph.whole(axes)? != [1] || attribute(node, "keepdims")?.i != 0 {
        return None;
    }
    let (squares, shape) = graph.reshaped(squares)?;
    let [_, components, BLOCK_I64, rows, columns] = shape[..] else { return None };
    let components = usize::try_from(components).ok().filter(|count| *count > 0)?;
    let [found, again] = graph.inputs(squares, "Mul")?;
    if found != again || [rows, columns] != [FINEST_SIDE as i64; 2] {
        return None;
    }
    Reader { graph, components }.read(found, mask)
}

const BLOCK_I64: i64 = BLOCK as i64;

struct Reader<'g, 'a> {
    graph: &'g Graph<'a>,
    components: usize,
}

impl<'a> Reader<'_, 'a> {
    /// Reads the levels, beginning with the components of the finest.
    fn read(&self, finest: &'a str, mask: Vec<f32>) -> Option<Parts> {
        let graph = self.graph;
        let mut levels = Vec::new();
        let (mut found, mut side) = (finest, FINEST_SIDE);
        let mut finer: Option<&str> = None;
        let mut unit = None;
        loop {
            let (level, blocks, above) = self.level(found, side)?;
            let source = self.blocks(blocks, side)?;
            if let Some(finer) = finer {
                (self.means(source)? == finer).then_some(())?;
            } else {
                unit = Some(self.unit(source)?);
            }
            levels.push(level);
            if levels.len() > LEVELS_MAX {
                return None;
            }
            if let Some(next) = graph.shuffled(above) {
                (found, side, finer) = (next, side / 2, Some(blocks));
                continue;
            }
            let (rank, reach_in, reach_out) = self.reach(above, blocks, side)?;
            let (unit, components) = (unit?, self.components);
            return (mask.len() == MAP_LEN).then_some(Parts {
                unit,
                components,
                levels,
                rank,
                reach_in,
                reach_out,
                mask,
            });
        }
    }

    /// A level, its blocks of pressure, and its input from the coarser level.
    fn level(&self, name: &str, side: usize) -> Option<(LevelParts, &'a str, &'a str)> {
        let graph = self.graph;
        let [linear, added] = graph.inputs(name, "Add")?;
        if graph.node(linear, "Add").is_none() {
            return self.linear(name, side);
        }
        let (mut level, blocks, above) = self.linear(linear, side)?;
        level.correction = Some(self.correction(added, linear, blocks, side)?);
        Some((level, blocks, above))
    }

    /// The same without the correction.
    fn linear(&self, name: &str, side: usize) -> Option<(LevelParts, &'a str, &'a str)> {
        let graph = self.graph;
        let channels = BLOCK * self.components;
        let [near, above] = graph.inputs(name, "Add")?;
        let [near, gain] = graph.inputs(near, "Mul")?;
        let (blocks, shape, near) = graph.convolution(near)?;
        let kernel = shape[2];
        let (above, mix_shape, weights) = graph.convolution(above)?;
        let (over_finger, place) = self.gain(gain, channels, side)?;
        let is_due = shape[..2] == [channels, BLOCK]
            && kernel <= KERNEL_MAX
            && mix_shape[..2] == [channels, self.components];
        let mix = mixed(mix_shape, &weights).filter(|_| is_due)?;
        let level = LevelParts { side, kernel, near, mix, over_finger, place, correction: None };
        Some((level, blocks, above))
    }

    fn correction(
        &self,
        name: &str,
        linear: &str,
        blocks: &str,
        side: usize,
    ) -> Option<CorrectionParts> {
        let graph = self.graph;
        let (gained, out_shape, out) = graph.convolution(name)?;
        let [gated, gain] = graph.inputs(gained, "Mul")?;
        let [value, gate] = graph.inputs(gated, "Mul")?;
        let [gate, least, most] = graph.inputs(gate, "Clip")?;
        let is_clamped = graph.is_scalar(least, -1.0) && graph.is_scalar(most, 1.0);
        let (joined, shape, value) = graph.convolution(value)?;
        let (again, gate_shape, gate) = graph.convolution(gate)?;
        let node = graph.node(joined, "Concat")?;
        let [hidden, inputs, kernel, _] = shape;
        let channels = BLOCK * self.components;
        let is_due = is_clamped
            && again == joined
            && gate_shape == shape
            && self::inputs(node)? == [linear, blocks]
            && attribute(node, "axis")?.i == 1
            && inputs == channels + BLOCK
            && hidden > 0
            && [1, 3].contains(&kernel)
            && out_shape == [channels, hidden, 1, 1];
        let (over_finger, place) = self.gain(gain, hidden, side).filter(|_| is_due)?;
        Some(CorrectionParts { hidden, inputs, kernel, value, gate, out, over_finger, place })
    }

    /// The weights and places of a [gain](super::gain).
    fn gain(&self, name: &str, channels: usize, side: usize) -> Option<(Vec<f32>, Vec<f32>)> {
        let graph = self.graph;
        let [varying, one] = graph.inputs(name, "Add")?;
        let [sum, axis] = graph.inputs(varying, "Unsqueeze")?;
        let node = graph.node(sum, "Einsum")?;
        let [weights, place] = inputs(node)?;
        let (shape, weights) = graph.shaped::<2>(weights)?;
        let (place_shape, place) = graph.shaped::<3>(place)?;
        let is_due = graph.is_scalar(one, 1.0)
            && graph.whole(axis)? == [0]
            && attribute(node, "equation")?.s == b"ck,kyx->cyx"
            && shape == [channels, place_shape[0]]
            && place_shape[1..] == [side; 2];
        is_due.then_some((weights, place))
    }

    /// If this arranges pixels in blocks of 2 x 2: the pixels.
    fn blocks(&self, name: &str, side: usize) -> Option<&'a str> {
        let graph = self.graph;
        let side = side as i64;
        let (turned, shape) = graph.reshaped(name)?;
        let node = graph.node(turned, "Transpose")?;
        let [split] = inputs(node)?;
        let (source, of_split) = graph.reshaped(split)?;
        let is_due = shape == [-1, BLOCK_I64, side, side]
            && attribute(node, "perm")?.ints == [0, 1, 3, 5, 2, 4]
            && of_split == [-1, 1, side, 2, side, 2];
        is_due.then_some(source)
    }

    /// If these are the means of blocks: the blocks.
    fn means(&self, name: &str) -> Option<&'a str> {
        let (blocks, shape, weights) = self.graph.convolution(name)?;
        (shape == [1, BLOCK, 1, 1] && weights == [0.25; BLOCK]).then_some(blocks)
    }

    /// The factor between the input in Pa and the network's pixels.
    fn unit(&self, name: &'a str) -> Option<f32> {
        let (map, unit) = self.graph.scaled(name)?;
        (map == INPUT_NAME).then_some(unit)
    }

    /// The global map, from the means of the coarsest blocks: its rank and both matrices.
    fn reach(&self, name: &str, blocks: &str, side: usize) -> Option<(usize, Vec<f32>, Vec<f32>)> {
        let graph = self.graph;
        let pixels = side * side;
        let (made, shape) = graph.reshaped(name)?;
        let [inner, outward] = graph.inputs(made, "MatMul")?;
        let [flat, inward] = graph.inputs(inner, "MatMul")?;
        let node = graph.node(flat, "Flatten")?;
        let [means] = inputs(node)?;
        let ([rows, rank], inward) = graph.shaped::<2>(inward)?;
        let (out_shape, outward) = graph.shaped::<2>(outward)?;
        let is_due = self.means(means)? == blocks
            && attribute(node, "axis").is_none_or(|axis| axis.i == 1)
            && shape == [-1, self.components as i64, side as i64, side as i64]
            && rows == pixels
            && rank > 0
            && out_shape == [rank, self.components * pixels];
        is_due.then_some((rank, inward, outward))
    }
}

/// Takes kernels `[4 C, C, 3, 3]` apart into a C x C matrix and the fixed weights of the
/// interpolation. Returns the matrix; None if the kernels are no such product.
fn mixed(shape: [usize; 4], weights: &[f32]) -> Option<Vec<f32>> {
    let [channels, components, rows, columns] = shape;
    if [rows, columns] != [3, 3] || channels != BLOCK * components {
        return None;
    }
    let (low, high) = ([NEXT, OWN, 0.0], [0.0, OWN, NEXT]);
    let between = |pixel: usize, tap: usize| {
        let [across, along] =
            [(pixel / 2, tap / 3), (pixel % 2, tap % 3)].map(|(half, tap)| [low, high][half][tap]);
        across * along
    };
    let mut mix = Vec::with_capacity(components * components);
    for of_component in weights.chunks_exact(BLOCK * components * 9) {
        // The corner weight of the first pixel is 1/16, so the division is exact.
        let row = (0..components).map(|from| of_component[9 * from] / between(0, 0));
        mix.extend(row);
        let row = &mix[mix.len() - components..];
        for (at, weight) in of_component.iter().enumerate() {
            let (pixel, from, tap) = (at / (9 * components), at / 9 % components, at % 9);
            let due = row[from] * between(pixel, tap);
            if !((weight - due).abs() <= ROUNDING * due.abs()) {
                return None;
            }
        }
    }
    Some(mix)
}
