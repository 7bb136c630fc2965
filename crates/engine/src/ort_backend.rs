//! ONNX Runtime, opened at run time as a shared library.

use crate::{
    Backend, EngineError, MAP_LEN, MAP_SIDE_PX, Model, ModelInfo, OUTPUT_NAME, Session, check_maps,
    check_output,
};
use ort::environment::Environment;
use ort::memory::Allocator;
use ort::session::{
    HasSelectedOutputs, OutputSelector, RunOptions, Session as OrtRun,
    builder::GraphOptimizationLevel,
};
use ort::value::Tensor;
use std::fmt::Display;
use std::sync::{Arc, OnceLock};

/// File name of the library if `ORT_DYLIB_PATH` does not name one. The system's loader searches for
/// it.
const LIBRARY: &str = if cfg!(target_os = "windows") {
    "onnxruntime.dll"
} else if cfg!(target_os = "macos") {
    "libonnxruntime.dylib"
} else {
    "libonnxruntime.so"
};

pub(crate) struct OrtModel {
    info: ModelInfo,
    onnx: Arc<[u8]>,
    environment: Environment,
}

impl OrtModel {
    /// `onnx` has passed the checks of the contract.
    pub(crate) fn load(onnx: &[u8], mut info: ModelInfo) -> Result<Self, EngineError> {
        let environment = environment()?;
        info.backend = format!("onnxruntime {}", version());
        Ok(Self { info, onnx: onnx.into(), environment })
    }
}

/// The one environment that a process may have. The first call opens the library.
pub(crate) fn environment() -> Result<Environment, EngineError> {
    static ENVIRONMENT: OnceLock<Result<Environment, String>> = OnceLock::new();
    let made = ENVIRONMENT.get_or_init(|| {
        let path = std::env::var("ORT_DYLIB_PATH").ok().filter(|path| !path.is_empty());
        let path = path.unwrap_or_else(|| LIBRARY.to_owned());
        let builder = ort::init_from(&path).map_err(|error| {
            format!(
                "{error}; set ORT_DYLIB_PATH to the library of ONNX Runtime 1.17 or newer \
                 (`pip install onnxruntime` brings onnxruntime/capi/libonnxruntime.so.*)"
            )
        })?;
        // ONNX Runtime must not report to anybody what is rendered here.
        builder.with_telemetry(false).build().map_err(|error| error.to_string())
    });
    made.clone().map_err(|reason| EngineError::BackendMissing { backend: Backend::Ort, reason })
}

/// The version of the library: the release branch or else the commit in its build information
/// (`ORT Build Info: git-branch=rel-1.19.0, git-commit-id=26250ae, ...`; wheels print
/// `git-branch=HEAD`).
fn version() -> String {
    let info = ort::info();
    let entry = |key: &str| {
        info.split(key).nth(1).and_then(|rest| rest.split([',', ' ']).next()).unwrap_or("unknown")
    };
    match entry("git-branch=").strip_prefix("rel-") {
        Some(release) => release.to_owned(),
        None => format!("commit {}", entry("git-commit-id=")),
    }
}

fn failed<E: Display>(action: &'static str) -> impl Fn(E) -> EngineError {
    move |error| EngineError::Backend { backend: Backend::Ort, action, reason: error.to_string() }
}

impl Model for OrtModel {
    fn info(&self) -> &ModelInfo {
        &self.info
    }

    fn backend(&self) -> Backend {
        Backend::Ort
    }

    fn session(&self) -> Result<Box<dyn Session>, EngineError> {
        let action = "set up a session";
        let run = OrtRun::builder(&self.environment)
            .map_err(failed(action))?
            .with_optimization_level(GraphOptimizationLevel::All)
            .map_err(failed(action))?
            // The service runs one thread per session.
            .with_intra_threads(1)
            .map_err(failed(action))?
            .commit_from_memory(&self.onnx)
            .map_err(failed("read the model"))?;
        let shape = [1, 1, MAP_SIDE_PX, MAP_SIDE_PX];
        let input = Tensor::from_array((shape, vec![0.0f32; MAP_LEN])).map_err(failed(action))?;
        let output = Tensor::<f32>::new(&Allocator::default(), shape).map_err(failed(action))?;
        let output =
            OutputSelector::no_default().with(OUTPUT_NAME).preallocate(OUTPUT_NAME, output);
        let options = RunOptions::new().map_err(failed(action))?.with_outputs(output);
        Ok(Box::new(OrtSession { run, input, options }))
    }
}

struct OrtSession {
    run: OrtRun,
    /// The input tensor, which is filled anew for each map.
    input: Tensor<f32>,
    /// Holds the output tensor, which is reused so that no map allocates one.
    options: RunOptions<HasSelectedOutputs>,
}

impl Session for OrtSession {
    fn infer(&mut self, pressure_pa: &[f32], sed_j_per_m3: &mut [f32]) -> Result<(), EngineError> {
        check_maps(pressure_pa, sed_j_per_m3)?;
        let action = "infer a map";
        self.input.extract_tensor_mut().1.copy_from_slice(pressure_pa);
        // Inputs are given by position, which allocates nothing; the contract has one input.
        let inputs = ort::inputs![&self.input];
        let outputs = self.run.run_with_options(inputs, &self.options).map_err(failed(action))?;
        let (_, answer) =
            outputs[OUTPUT_NAME].try_extract_tensor::<f32>().map_err(failed(action))?;
        if answer.len() != MAP_LEN {
            return Err(failed(action)(format!("the answer has {} values", answer.len())));
        }
        sed_j_per_m3.copy_from_slice(answer);
        check_output(sed_j_per_m3)
    }
}
