//! The constants of a network on maps, as they were found in its graph.

/// A network: `[1, 1, 224, 224]` Pa to `[1, 1, 224, 224]` J/m3.
#[derive(Debug)]
pub(super) struct Parts {
    /// The factor from Pa to the network's unit.
    pub unit: f32,
    /// Number of strain components, C.
    pub components: usize,
    /// The levels, the finest first.
    pub levels: Vec<LevelParts>,
    pub rank: usize,
    /// The two matrices of the global map, `[n^2, rank]` and `[rank, C n^2]`, with n of the
    /// coarsest level.
    pub reach_in: Vec<f32>,
    pub reach_out: Vec<f32>,
    /// The factor from the network's densities to J/m3 at each pixel, `[224, 224]`.
    pub mask: Vec<f32>,
}

/// A level of n x n blocks.
#[derive(Debug)]
pub(super) struct LevelParts {
    pub side: usize,
    /// Width of the near field's kernel in blocks, K.
    pub kernel: usize,
    /// `[4 C, 4, K, K]`.
    pub near: Vec<f32>,
    /// `[C, C]`: the matrix that mixes the components from above before they are interpolated.
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
    /// Width of the kernels in blocks, K.
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
