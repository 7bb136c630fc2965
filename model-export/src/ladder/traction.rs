//! What traction along the skin is worth for each model.

use super::Task;
use super::model::session;
use crate::contact::Models;
use crate::dataset::Dataset;
use crate::{ExportError, read, shear};
use papilla_engine::ladder::Traction;

/// Datasets of presses with friction: straight in; then dragged aside.
const SETS: [&str; 2] = ["friction-graded", "sliding-graded"];

/// The contact model, in the folder of models.
const FINGER: &str = "finger.contact";

/// Every model on every set that is there; nothing without a contact model.
pub(super) fn measure(task: &Task, models: &[String]) -> Result<Vec<Traction>, ExportError> {
    let finger = task.models.join(FINGER);
    let folders = SETS.map(|name| task.data.join(name));
    let there: Vec<_> = folders.iter().filter(|f| f.join("manifest.json").is_file()).collect();
    if !finger.is_file() || there.is_empty() {
        return Ok(Vec::new());
    }
    let finger = Models::read(&finger)?;
    let mut found = Vec::new();
    for folder in there {
        let dataset = Dataset::open(folder)?;
        finger.require_atlas(&dataset, folder)?;
        for name in models {
            let path = task.models.join(format!("{name}.onnx"));
            let model =
                papilla_engine::load(&read(&path)?, None).map_err(ExportError::engine(&path))?;
            let mut session = session(model.as_ref(), &path)?;
            found.push(shear::measure(&finger, &dataset, (name, session.as_mut()))?);
        }
    }
    Ok(found)
}
