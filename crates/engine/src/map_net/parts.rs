//! The constants of a network on maps, as they were found in its graph.

/// A network: `[1, 1, 224, 224]` Pa to `[1, 1, 224, 224]` J/m3.
#[derive(Debug)]
pub(super) struct Parts {
    /// What pressures are multiplied with.
    pub unit: f32,
    /// Pixels across one of the network's: 1 or 2.
    pub pixel: usize,
    /// Strain components, C.
    pub components: usize,
    /// The finest first.
    pub levels: Vec<LevelParts>,
    pub rank: usize,
    /// `[n^2, rank]` and `[rank, C n^2]`, n of the coarsest level.
    pub reach_in: Vec<f32>,
    pub reach_out: Vec<f32>,
    /// What the densities are multiplied with, `[224, 224]`.
    pub mask: Vec<f32>,
}

/// A level of n x n blocks.
#[derive(Debug)]
pub(super) struct LevelParts {
    pub side: usize,
    /// Blocks across the convolution, K.
    pub kernel: usize,
    /// `[4 C, 4, K, K]`.
    pub near: Vec<f32>,
    /// `[C, C]`: the matrix that is mixed with before the interpolation.
    pub mix: Vec<f32>,
    /// `[4 C, places]`.
    pub over_finger: Vec<f32>,
    /// `[places, n, n]`.
    pub place: Vec<f32>,
    pub correction: Option<CorrectionParts>,
}

/// The correction of a level.
#[derive(Debug)]
pub(super) struct CorrectionParts {
    pub hidden: usize,
    /// `4 C + 4`.
    pub inputs: usize,
    /// Blocks across, K.
    pub kernel: usize,
    /// `[hidden, inputs, K, K]`.
    pub value: Vec<f32>,
    pub gate: Vec<f32>,
    /// `[4 C, hidden]`.
    pub out: Vec<f32>,
    /// `[hidden, places]`.
    pub over_finger: Vec<f32>,
    /// `[places, n, n]`.
    pub place: Vec<f32>,
}
