//! tract, the engine that is always there.

use crate::{
    Backend, EngineError, MAP_LEN, MAP_SIDE_PX, Model, ModelInfo, Session, check_maps,
    check_output, convolution, guard::guarded, moves, products, sparse,
};
use std::sync::Arc;
use tract_onnx::pb::ModelProto;
use tract_onnx::prelude::*;
use tract_onnx::tract_core::model::TypedSimpleState;

/// Backend and version, for cards and logs. A test compares it with `Cargo.lock`.
pub(crate) const LABEL: &str = "tract 0.23.9";

/// The most values in all tensors together (1 GiB of f32). A garbled shape is refused before it is
/// allocated, since an allocation beyond the memory there is would abort the process.
pub(crate) const TENSOR_LEN_MAX: i64 = 1 << 28;

pub(crate) struct TractModel {
    info: ModelInfo,
    plan: Arc<TypedRunnableModel>,
}

impl TractModel {
    /// `proto` has passed the checks of the contract; its constants have been widened.
    pub(crate) fn load(proto: &ModelProto, mut info: ModelInfo) -> Result<Self, EngineError> {
        info.backend = LABEL.to_owned();
        let typed = guarded("read the model", || {
            let typed = tract_onnx::onnx().model_for_proto_model(proto)?.into_typed()?;
            convolution::run_direct(products::keep_joined(typed)?)
        })?;
        check_sizes(&typed)?;
        let plan = guarded("optimise the model", || {
            // Done a second time, since a bias that was reshaped is known to be constant only now.
            let direct = convolution::run_direct(typed.into_decluttered()?)?;
            let fused = sparse::fuse(direct)?;
            let stacked = products::stack(fused)?;
            moves::run_by_rows(stacked)?.into_optimized()?.into_runnable()
        })?;
        Ok(Self { info, plan })
    }

    pub(crate) fn plan(&self) -> &Arc<TypedRunnableModel> {
        &self.plan
    }
}

/// The shape of every map in tract and ONNX.
pub(crate) const SHAPE: [usize; 4] = [1, 1, MAP_SIDE_PX, MAP_SIDE_PX];

fn check_sizes(model: &TypedModel) -> Result<(), EngineError> {
    let mut left = TENSOR_LEN_MAX;
    for node in &model.nodes {
        for outlet in &node.outputs {
            let values = outlet.fact.shape.volume();
            match values.to_i64() {
                Ok(values) if (0..=left).contains(&values) => left -= values,
                _ => {
                    return Err(EngineError::TooLarge {
                        node: node.name.clone(),
                        values: values.to_string(),
                        limit: left,
                    });
                }
            }
        }
    }
    Ok(())
}

impl Model for TractModel {
    fn info(&self) -> &ModelInfo {
        &self.info
    }

    fn backend(&self) -> Backend {
        Backend::Tract
    }

    fn session(&self) -> Result<Box<dyn Session>, EngineError> {
        let (state, input) = guarded("set up a session", || {
            Ok((self.plan.spawn()?, Tensor::zero::<f32>(&SHAPE)?.into_arc_tensor()))
        })?;
        Ok(Box::new(TractSession { plan: Arc::clone(&self.plan), state, input }))
    }
}

struct TractSession {
    plan: Arc<TypedRunnableModel>,
    state: TypedSimpleState,
    /// The input tensor, which is filled anew for each map. tract drops its reference when a run
    /// ends.
    input: Arc<Tensor>,
}

impl TractSession {
    fn run(&mut self, pressure_pa: &[f32], sed_j_per_m3: &mut [f32]) -> TractResult<()> {
        // Allocates only if tract still holds the tensor, as after an error.
        let input = Arc::make_mut(&mut self.input);
        input.try_as_plain_ram_mut()?.as_slice_mut::<f32>()?.copy_from_slice(pressure_pa);
        let outputs = self.state.run(tvec!(Arc::clone(&self.input).into_tvalue()))?;
        let answer = outputs[0].try_as_plain_ram()?;
        let answer = answer.as_slice::<f32>()?;
        if answer.len() != MAP_LEN {
            return Err(TractError::msg(format!("the answer has {} values", answer.len())));
        }
        sed_j_per_m3.copy_from_slice(answer);
        Ok(())
    }
}

impl Session for TractSession {
    fn infer(&mut self, pressure_pa: &[f32], sed_j_per_m3: &mut [f32]) -> Result<(), EngineError> {
        check_maps(pressure_pa, sed_j_per_m3)?;
        if let Err(error) = guarded("infer a map", || self.run(pressure_pa, sed_j_per_m3)) {
            // The state after an interrupted run is unknown, so it is made anew.
            self.state = guarded("set up a session", || self.plan.spawn())?;
            return Err(error);
        }
        check_output(sed_j_per_m3)
    }
}
