//! The errors of networks and contact in states that no training saw, and the facts that their
//! answers show.

use super::{METHODS, SETS, Set};
use crate::contact::{Models, Placed, Rung, pixel_contact};
use crate::dataset::Dataset;
use crate::metrics::relative_l2_on;
use crate::split::SplitOrAll;
use crate::{ExportError, read, read_text};
use papilla_contact::{Contact, Person, PixelContact, Scene, Solver};
use papilla_dataset::{IndentationEntry, Shard};
use papilla_engine::error_law::Facts;
use papilla_engine::{Card, EngineError, MAP_LEN, Model, Session};
use papilla_proto::atlas::Patch;
use papilla_proto::contact::ContactMethod;
use papilla_proto::effects::OutOfRange;
use papilla_proto::{MapSummary, PressureRange, flags, peak};
use papilla_render::{Known, Maps, Read, Rendering, SkinPixels, Source, facts_of_force};
use papilla_session_contact::Felt;
use papilla_vector::norm;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// One answer about one state.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Case {
    /// Name of the set.
    pub set: String,
    /// Number of the simulation in it.
    pub simulation: usize,
    /// Which of its states.
    pub state: usize,
    /// What pressed.
    pub indenter: String,
    /// Depth, mm.
    pub depth_mm: f32,
    /// The network; none: the force.
    pub network: Option<String>,
    /// How pressure was found; none: FE's is given.
    pub method: Option<ContactMethod>,
    /// What the answer shows; values that are no numbers are null.
    #[serde(with = "facts")]
    pub facts: Facts,
    /// Whether a flag tells already that the answer may be wrong in ways that no law covers.
    pub is_flagged: bool,
    /// The true relative error.
    pub error: f64,
}

/// Facts as a list.
mod facts {
    use papilla_engine::error_law::{Fact, Facts};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    fn all() -> impl Iterator<Item = Fact> {
        Fact::OF_SED.into_iter()
    }

    pub(super) fn serialize<S: Serializer>(facts: &Facts, to: S) -> Result<S::Ok, S::Error> {
        let known = |fact| Some(facts.get(fact)).filter(|value| value.is_finite());
        all().map(known).collect::<Vec<Option<f32>>>().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Facts, D::Error> {
        let values: Vec<Option<f32>> = Vec::deserialize(from)?;
        let mut facts = Facts::default();
        for (fact, value) in all().zip(values) {
            facts.set(fact, value.unwrap_or(f32::NAN));
        }
        Ok(facts)
    }
}

/// All answers, and what they are by.
#[derive(Debug, Serialize, Deserialize)]
pub struct States {
    /// Hash of the atlas.
    pub atlas_hash: String,
    /// SHA-256 of the contact model's file.
    pub contact_sha256: String,
    /// Name and SHA-256 of each network.
    pub networks: Vec<(String, String)>,
    /// The answers.
    pub cases: Vec<Case>,
}

struct Network {
    card: Card,
    model: Arc<dyn Model>,
    session: Box<dyn Session>,
}

impl Network {
    fn read(folder: &Path, name: &str) -> Result<Self, ExportError> {
        let path = folder.join(format!("{name}.onnx"));
        let card = read_text(&path.with_extension("json"))?;
        let card = Card::from_json(&card).map_err(ExportError::engine(&path))?;
        let model =
            papilla_engine::load(&read(&path)?, Some(&card)).map_err(ExportError::engine(&path))?;
        let session = model.session().map_err(ExportError::engine(&path))?;
        Ok(Self { card, model, session })
    }
}

/// What finds the pressure of a dataset's states.
struct Finder {
    method: ContactMethod,
    solver: Solver,
    pixels: Option<PixelContact>,
}

impl Finder {
    fn all(models: &Models, dataset: &Dataset) -> Vec<Self> {
        let of = |rung: Rung| {
            let pixels = match rung.pixel_spacing() {
                Some(spacing) => Some(pixel_contact(models, dataset, spacing)?),
                None => None,
            };
            let method = rung.method().filter(|method| METHODS.contains(method))?;
            let solver = models.solver(rung)?;
            Some(Self { method, solver, pixels })
        };
        Rung::ALL.into_iter().filter_map(of).collect()
    }

    /// Finds the pressure as a frame from nothing; false where it cannot.
    fn find(
        &mut self,
        placed: &Placed,
        shard: &Shard,
        state: usize,
        dataset: &Dataset,
        out: &mut Contact,
        map_pa: &mut [f32],
    ) -> bool {
        let object = placed.at(f64::from(shard.depth_mm[state]), shard.slid_mm(state));
        self.solver.reset();
        match &mut self.pixels {
            Some(pixels) => {
                pixels.reset();
                let solved = self.solver.solve_on_pixels(&[object], pixels, out);
                map_pa.copy_from_slice(pixels.map_pa());
                solved.is_ok()
            }
            None => {
                let skin = dataset.maps.raster(Patch::Skin);
                self.solver.solve(Scene::Objects(&[object]), out).is_ok()
                    && skin.rasterise(&out.pressure_pa, map_pa).is_ok()
            }
        }
    }
}

/// One state of a dataset.
struct At<'a> {
    dataset: &'a Dataset,
    indentation: &'a IndentationEntry,
    shard: &'a Shard,
    state: usize,
    set: &'a Set,
    skin: &'a SkinPixels,
}

impl At<'_> {
    fn case(&self, network: Option<&str>, method: Option<ContactMethod>) -> Case {
        Case {
            set: self.set.folder.to_owned(),
            simulation: self.indentation.id,
            state: self.state,
            indenter: self.indentation.indenter.clone(),
            depth_mm: self.shard.depth_mm[self.state],
            network: network.map(str::to_owned),
            method,
            facts: Facts::default(),
            is_flagged: false,
            error: f64::NAN,
        }
    }
}

impl States {
    /// Whether there is nothing to fit to.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cases.is_empty()
    }

    /// Asks all networks, given FE's pressure and that of every method of contact, about the states
    /// of all sets that are in `data`. `step` is called after each state.
    ///
    /// # Errors
    /// [`ExportError`] of a dataset, a network or the contact model.
    pub fn of(
        data: &Path,
        folder: &Path,
        names: &[String],
        mut step: impl FnMut(),
    ) -> Result<Self, ExportError> {
        let contact_path = folder.join("finger.contact");
        let models = Models::read(&contact_path)?;
        let networks = names.iter().map(|name| Network::read(folder, name));
        let mut networks = networks.collect::<Result<Vec<_>, _>>()?;
        let mut states = Self {
            atlas_hash: String::new(),
            contact_sha256: papilla_dataset::sha256_hex(&read(&contact_path)?),
            networks: networks
                .iter()
                .map(|of| (of.card.name.clone(), of.card.onnx_sha256.clone()))
                .collect(),
            cases: Vec::new(),
        };
        for set in SETS {
            let path = data.join(set.folder);
            if !path.join("manifest.json").is_file() {
                continue;
            }
            let dataset = Dataset::open(&path)?;
            models.require_atlas(&dataset, &path)?;
            for network in &networks {
                let what = path.display().to_string();
                let atlas = dataset.atlas().hash();
                crate::evaluate::require_atlas(&what, atlas, network.model.info())?;
            }
            dataset.atlas().hash().clone_into(&mut states.atlas_hash);
            let indentations = match set.split {
                SplitOrAll::All => dataset.every_indentation(),
                split @ SplitOrAll::Split(_) => dataset.indentations(split)?,
            };
            let skin = SkinPixels::from(dataset.maps.raster(Patch::Skin));
            let mut finders = Finder::all(&models, &dataset);
            for indentation in indentations {
                let taken = |state: &usize| set.takes(indentation.id, *state);
                let states_taken: Vec<usize> = (0..indentation.samples).filter(taken).collect();
                if states_taken.is_empty() {
                    continue;
                }
                let shard = dataset.shard(indentation)?;
                let placed = Placed::at_first_touch(&dataset, indentation, &shard)?;
                for state in states_taken {
                    let (dataset, indentation, shard) = (&dataset, indentation, &shard);
                    let at = At { dataset, indentation, shard, state, set: &set, skin: &skin };
                    states.add(&at, placed.as_ref(), &mut finders, &mut networks)?;
                    step();
                }
            }
        }
        Ok(states)
    }

    /// Adds the answers about one state.
    fn add(
        &mut self,
        at: &At<'_>,
        placed: Option<&Placed>,
        finders: &mut [Finder],
        networks: &mut [Network],
    ) -> Result<(), ExportError> {
        let &At { dataset, indentation, shard, state, .. } = at;
        let mut maps = Maps::default();
        let [mut given, mut truth] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
        dataset.draw_pressure(indentation, shard, state, &mut given)?;
        dataset.draw_sed(indentation, shard, state, &mut truth)?;
        for network in &mut *networks {
            maps.pressure_pa.copy_from_slice(&given);
            self.cases.extend(ask(at, network, &mut maps, Source::Map, &truth)?);
        }
        let Some(placed) = placed else { return Ok(()) };
        let mut out = Contact::default();
        for finder in finders {
            out = Contact::new(out.pressure_pa.len().max(dataset.atlas().vertex_count()));
            if !finder.find(placed, shard, state, dataset, &mut out, &mut given) {
                continue;
            }
            let method = finder.method;
            let felt = Felt::of(method, &out, Person::default());
            let source = felt.map_or(Source::Other, Source::Contact);
            let due = norm([0, 1, 2].map(|i| f64::from(shard.force_n[[state, i]])));
            let error = (norm(out.force_n) / due - 1.0).abs();
            let (is_flagged, facts) =
                felt.map_or((true, Facts::default()), |felt| (false, facts_of_force(felt)));
            let case = at.case(None, Some(method));
            self.cases.push(Case { facts, is_flagged, error, ..case });
            // What learnt FE's pressure alone is not offered for contact's.
            for network in
                networks.iter_mut().filter(|network| network.card.learnt().knows_contact())
            {
                maps.pressure_pa.copy_from_slice(&given);
                let case = ask(at, network, &mut maps, source, &truth)?;
                let method = Some(method);
                self.cases.extend(case.map(|case| Case { method, ..case }));
            }
        }
        Ok(())
    }
}

/// What a network answers about the pressure in `maps`, as a service asks it; none where the truth
/// has no energy, or where the engine refuses the answer.
fn ask(
    at: &At<'_>,
    network: &mut Network,
    maps: &mut Maps,
    source: Source,
    truth: &[f32],
) -> Result<Option<Case>, ExportError> {
    let Network { card, session, .. } = network;
    let range =
        PressureRange { trained_max_pa: card.pressure_range_pa[1], beyond: OutOfRange::Clamp };
    let known = Known {
        skin: at.skin,
        input_max: card.input_statistics_max,
        response_max_per_mpa: card.response_max_per_mpa,
        errors: None,
    };
    let summary = MapSummary { peak_pa: peak(&maps.pressure_pa) };
    let read = Read { summary, range, time_us: 0, is_tracked: true, shows_sed: true, source };
    let mut rendering = Rendering::begin(maps, None, None, known, read);
    if !rendering.touches() {
        return Ok(None);
    }
    match rendering.infer(session.as_mut()) {
        Ok(()) => {}
        Err(EngineError::NegativeOutput { .. } | EngineError::NonFiniteOutput { .. }) => {
            return Ok(None);
        }
        Err(source) => {
            let path = at.dataset.shard_path(at.indentation);
            return Err(ExportError::Engine { path, source });
        }
    }
    let unlike = flags::UNFAMILIAR | flags::CUT_OFF | flags::OUT_OF_RANGE;
    let facts = rendering.facts();
    let is_flagged = rendering.flags() & unlike != 0 || source == Source::Other;
    let found = relative_l2_on(&at.dataset.ground, &maps.sed_j_per_m3, truth);
    let case = at.case(Some(&card.name), None);
    Ok(found.map(|error| Case { facts, is_flagged, error, ..case }))
}
