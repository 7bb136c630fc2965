//! What the conformance script expects (`proto/conformance.json`, docs/reference/conformance.md).
//!
//! Maps come from the engine, everything else from the formulas of the documentation
//! (`finger`): nothing here asks the server, which is one of the things that are tested.

mod contact;
mod due;
mod engines;
mod errors;
mod finger;
pub mod inputs;
mod print;
mod session;

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

use papilla_engine::Card;
use papilla_proto::{
    Hello, MAP_LEN,
    atlas::{Atlas, AtlasError, Patch, Raster},
    contact::Input,
    input_statistics::PressedCells,
};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

pub use contact::{ContactRecorder, depth};
pub use print::print;

use contact::Hand;
use due::Due;
use errors::Errors;
use finger::Surface;
use inputs::{Contact, Pressure, Vertices};
use session::Session;

/// Why nothing can be recorded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConformanceError {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The atlas cannot be used.
    #[error(transparent)]
    Atlas(#[from] AtlasError),
    /// A model cannot be run.
    #[error(transparent)]
    Engine(#[from] papilla_engine::EngineError),
    /// The contact model cannot be made.
    #[error(transparent)]
    Contact(#[from] papilla_contact::ModelError),
    /// Pixels cannot be made of the contact model's layers.
    #[error("the contact model of the script has no layers, which pixels need")]
    Layers,
    /// A step is not of the format.
    #[error("case {case}, step {step}: {reason}")]
    Step {
        /// Name of the case.
        case: String,
        /// Number of the step, from 0.
        step: usize,
        /// What is wrong with it.
        reason: String,
    },
}

/// A tier, ready to be asked.
struct Tier {
    session: Box<dyn papilla_engine::Session>,
    pressure_max_pa: f32,
    onnx_sha256: String,
    /// What the training pressed; none if the network was not trained on maps.
    pressed: Option<PressedCells>,
}

impl Tier {
    fn render(&mut self, pressure_pa: &[f32]) -> Result<Vec<f32>, String> {
        let mut sed = vec![0.0; MAP_LEN];
        if pressure_pa.iter().any(|&p| p > 0.0) {
            self.session.infer(pressure_pa, &mut sed).map_err(|error| error.to_string())?;
        }
        Ok(sed)
    }
}

/// Computes what the cases expect.
pub struct Recorder {
    folder: PathBuf,
    atlas: Atlas,
    raster: Raster,
    skin: Surface,
    interface: Surface,
    tiers: HashMap<String, Tier>,
    errors: Errors,
    /// With the contact model that ships; loaded by the first case of poses.
    contact: Option<ContactRecorder>,
}

/// The session of a case, and the solvers of its fingers if it sends poses.
#[derive(Default)]
struct Open {
    session: Option<Session>,
    hand: Option<Hand>,
}

fn read(path: PathBuf) -> Result<Vec<u8>, ConformanceError> {
    fs::read(&path).map_err(|source| ConformanceError::Io { path, source })
}

/// A member of a step, by its type.
fn member<T: DeserializeOwned>(of: &Value, name: &str) -> Result<T, String> {
    let value = of.get(name).cloned().unwrap_or(Value::Null);
    serde_json::from_value(value).map_err(|error| format!("'{name}': {error}"))
}

impl Recorder {
    /// With the models in `folder`.
    ///
    /// # Errors
    /// The atlas or the laws of errors are missing or damaged.
    pub fn new(folder: &Path) -> Result<Self, ConformanceError> {
        let text = String::from_utf8_lossy(&read(folder.join("atlas.json"))?).into_owned();
        let atlas = Atlas::from_json(&text)?;
        let raster = Raster::new(&atlas, Patch::Skin);
        let interface = Raster::new(&atlas, Patch::Interface);
        Ok(Self {
            folder: folder.to_owned(),
            skin: Surface::new(&atlas, &raster, Patch::Skin),
            interface: Surface::new(&atlas, &interface, Patch::Interface),
            raster,
            atlas,
            tiers: HashMap::new(),
            errors: Errors::read(folder)?,
            contact: None,
        })
    }

    /// Writes what is expected into every step that asks for a number; what it asks for, and all
    /// inputs, stay as they are.
    ///
    /// # Errors
    /// A model is missing, or a step is not of the format; it says which.
    pub fn fill(&mut self, file: &mut Value) -> Result<(), ConformanceError> {
        file["atlas_hash"] = json!(self.atlas.hash());
        let cases = file["cases"].as_array_mut().into_iter().flatten();
        for case in cases {
            let name = case["name"].as_str().unwrap_or_default().to_owned();
            let mut open = Open::default();
            for (number, step) in case["steps"].as_array_mut().into_iter().flatten().enumerate() {
                self.step(step, &mut open).map_err(|reason| ConformanceError::Step {
                    case: name.clone(),
                    step: number,
                    reason,
                })?;
            }
        }
        Ok(())
    }

    fn step(&mut self, step: &mut Value, open: &mut Open) -> Result<(), String> {
        let refused = step["expect"]["status"].as_str().is_some_and(|status| status != "ok");
        match step["do"].as_str() {
            Some("hello") if !refused => {
                let hello: Hello = member(step, "hello")?;
                if hello.input == Some(Input::Objects) {
                    self.contact()?.step(step, &mut open.hand)?;
                }
                open.session = Some(Session::new(hello)?);
            }
            Some("frame") if !refused => {
                let session = open.session.as_mut().ok_or("a frame without a hello")?;
                let due = self.frame(step, session, 1.0)?;
                due.fill(&mut step["expect"]);
                if asks_for_error(step) {
                    step["expect"]["error_estimate"] = self.error_of_map(step, session)?;
                }
            }
            Some("touch") => {
                let session = open.session.as_ref().ok_or("a touch without a hello")?;
                self.contact()?.step(step, &mut open.hand)?;
                if asks_for_error(step) {
                    let error = self.error_of_touch(step, session, open.hand.as_ref())?;
                    step["expect"]["error_estimate"] = error;
                }
            }
            Some("burst") => {
                // The last frame is the whole input.
                let session = open.session.as_mut().ok_or("a burst without a hello")?;
                let due = self.frame(step, session, 1.0)?;
                due.fill(&mut step["expect"]["newest"]);
            }
            Some("http") if !refused => {
                let tier = member(step, "tier")?;
                let hello = Hello { tier: Some(tier), ..Hello::default() };
                let due = self.frame(step, &mut Session::new(hello)?, 1.0)?;
                due.fill(&mut step["expect"]);
            }
            Some("rasterise") => {
                let vertices: Vertices = member(step, "vertices")?;
                let values = vertices.values(&self.atlas.patch(Patch::Skin).positions_mm);
                let mut map = vec![0.0; MAP_LEN];
                self.raster.rasterise(&values, &mut map).map_err(|error| error.to_string())?;
                Due::of_map(&map.iter().map(|&v| f64::from(v)).collect::<Vec<_>>(), 1e-5)
                    .fill(&mut step["expect"]);
            }
            Some("contacts") => {
                let contacts: Vec<Contact> = member(step, "contacts")?;
                let map_pa = self.skin.contacts(&contacts);
                let force_n = 1e-6 * self.skin.integral(|i| map_pa[i]);
                let due = Due { force_n, ..Due::of_map(&map_pa, 1e-4) };
                due.fill(&mut step["expect"]);
            }
            Some(
                "hello" | "frame" | "http" | "reconnect" | "move" | "address" | "token" | "silence",
            ) => {}
            other => return Err(format!("there is no step '{other:?}'")),
        }
        Ok(())
    }

    fn frame(&mut self, step: &Value, session: &mut Session, share: f64) -> Result<Due, String> {
        let input: Pressure = member(step, "pressure")?;
        if input.is_doubtful() {
            return Err("a pixel of the map lies on a limit; move it a little".to_owned());
        }
        let window: Option<[usize; 4]> = member(step, "window")?;
        let time_us: Option<u64> = member(step, "client_time_us")?;
        let sent_pa = input.draw(share, window);
        let tier = self.tier(&session.tier)?;
        let answer = session.render(tier, &sent_pa, time_us.unwrap_or(0))?;
        session.due(&answer, &sent_pa, (&self.skin, &self.interface))
    }

    /// How wrong the answer to a map is likely to be; an answer with a flag states nothing.
    fn error_of_map(&mut self, step: &Value, session: &Session) -> Result<Value, String> {
        if !session.tells_error() || is_flagged(step) {
            return Ok(errors::not_stated());
        }
        let input: Pressure = member(step, "pressure")?;
        self.load(&session.tier)?;
        let tier = self.tiers.get_mut(&session.tier).ok_or("no such tier")?;
        self.errors.of_map(tier, &input.draw(1.0, None))
    }

    /// The same of an answer to poses.
    fn error_of_touch(
        &mut self,
        step: &Value,
        session: &Session,
        hand: Option<&Hand>,
    ) -> Result<Value, String> {
        if !session.tells_error() || is_flagged(step) {
            return Ok(errors::not_stated());
        }
        let finger: Option<usize> = member(step, "finger")?;
        let found = hand.and_then(|hand| hand.pressed(finger.unwrap_or(0)));
        let found = found.ok_or("an error is told of contact on pixels alone")?;
        self.load(&session.tier)?;
        let tier = self.tiers.get_mut(&session.tier).ok_or("no such tier")?;
        let contact = self.contact.as_ref().ok_or("no contact model")?;
        self.errors.of_contact(tier, contact.sha256(), &found)
    }

    /// What contact is, by the contact model that ships.
    fn contact(&mut self) -> Result<&ContactRecorder, String> {
        if self.contact.is_none() {
            let shipped = ContactRecorder::shipped(&self.folder);
            self.contact = Some(shipped.map_err(|error| error.to_string())?);
        }
        self.contact.as_ref().ok_or_else(|| "no contact model".to_owned())
    }

    fn tier(&mut self, name: &str) -> Result<&mut Tier, String> {
        self.load(name)?;
        self.tiers.get_mut(name).ok_or_else(|| format!("no tier {name}"))
    }

    fn load(&mut self, name: &str) -> Result<(), String> {
        if !self.tiers.contains_key(name) {
            let load = || {
                let onnx = read(self.folder.join(format!("{name}.onnx")))?;
                let card = read(self.folder.join(format!("{name}.json")))?;
                let card = Card::from_json(&String::from_utf8_lossy(&card))?;
                let model = papilla_engine::load(&onnx, Some(&card))?;
                Ok::<_, ConformanceError>(Tier {
                    session: model.session()?,
                    pressure_max_pa: model.info().pressure_max_pa,
                    pressed: card.input_statistics_max.map(|most| most.cells),
                    onnx_sha256: card.onnx_sha256,
                })
            };
            let tier = load().map_err(|error| error.to_string())?;
            self.tiers.insert(name.to_owned(), tier);
        }
        Ok(())
    }
}

/// Whether a step asks how wrong its answer is likely to be.
fn asks_for_error(step: &Value) -> bool {
    step["expect"].get("error_estimate").is_some()
}

/// Whether the answer has a flag.
fn is_flagged(step: &Value) -> bool {
    step["expect"]["flags"].as_array().is_some_and(|flags| !flags.is_empty())
}

/// A value to seven digits and its tolerance to two.
fn pair((value, (share, beside)): (&f64, (f64, f64))) -> Value {
    let digits = |v: f64, n: usize| format!("{v:.n$e}").parse::<f64>().unwrap_or(v);
    json!([digits(*value, 6), digits(share * value.abs() + beside, 1)])
}

#[cfg(test)]
mod tests;
