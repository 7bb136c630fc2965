//! The held-out sets of the ladder: states that no training saw, on which all rungs are measured.

use super::Canvas;
use crate::ExportError;
use crate::contact::{ContactMaps, Models};
use crate::dataset::Dataset;
use crate::evaluate::require_same_atlas;
use crate::split::SplitOrAll;
use papilla_dataset::{IndentationEntry, Split};
use papilla_engine::{
    MAP_LEN,
    ladder::{POSES_SET, REFERENCE_SET, Set},
};
use papilla_proto::atlas::{Patch, Raster};
use std::path::Path;

/// One state: values at the pixels of the atlas' patches, in the rasters' order.
#[derive(Clone, Debug)]
pub struct State {
    /// Where it is from, for messages.
    pub origin: String,
    /// Number of the indentation within its campaign.
    pub indentation: usize,
    /// Number of the state within the indentation.
    pub number: usize,
    /// Depth, mm.
    pub depth_mm: f32,
    /// Pressure on the skin, Pa.
    pub pressure_pa: Vec<f32>,
    /// True SED on the dermis side of the interface, J/m3.
    pub sed_j_per_m3: Vec<f32>,
}

impl State {
    /// Whether it is this one, perhaps on another mesh.
    pub(super) fn is_of(&self, other: &Self) -> bool {
        self.indentation == other.indentation
            && (self.depth_mm - other.depth_mm).abs() <= 1e-5 * other.depth_mm
    }

    /// What is wrong with a truth that is zero everywhere.
    pub(super) fn without_sed(&self, sample: usize) -> ExportError {
        ExportError::Truth { path: (&self.origin).into(), sample, reason: "it is zero" }
    }
}

/// Draws a patch's values: overwrites the map, 0 outside the patch.
pub(super) fn draw(raster: &Raster, values: &[f32], map: &mut [f32]) {
    map.fill(0.0);
    for (&pixel, value) in raster.indices().iter().zip(values) {
        map[pixel as usize] = *value;
    }
}

/// States that no training saw.
#[derive(Clone, Debug)]
pub struct SampleSet {
    /// One of [`papilla_engine::ladder::SET_NAMES`].
    pub name: &'static str,
    /// What it holds, or why it is empty.
    pub about: String,
    /// Names the dataset.
    pub dataset_sha256: Option<String>,
    /// The states.
    pub states: Vec<State>,
}

impl SampleSet {
    /// All states of a dataset.
    pub(super) fn of(
        folder: &Path,
        dataset: &Dataset,
        canvas: &Canvas,
    ) -> Result<Self, ExportError> {
        let what = folder.display().to_string();
        require_same_atlas(&what, dataset.atlas().hash(), &canvas.atlas_hash)?;
        REFERENCE.taken_of(dataset)
    }

    /// Keeps at most `count` states, evenly spread.
    pub fn thin(&mut self, count: usize) {
        let have = self.states.len();
        if have > count {
            let keep = |k: usize| self.states[(2 * k + 1) * have / (2 * count)].clone();
            self.states = (0..count).map(keep).collect();
            self.about = format!("{count} of {have} samples: {}", self.about);
        }
    }

    pub(super) fn described(&self) -> Set {
        Set {
            name: self.name.to_owned(),
            samples: self.states.len(),
            about: self.about.clone(),
            dataset_sha256: self.dataset_sha256.clone(),
        }
    }
}

/// What a set takes of a dataset.
pub(super) struct Source {
    name: &'static str,
    folder: &'static str,
    about: &'static str,
    split: SplitOrAll,
}

const REFERENCE: Source = Source {
    name: REFERENCE_SET,
    folder: "final",
    about: "presses on the finest mesh, of shapes, poses and a seed by which nothing was chosen",
    split: SplitOrAll::All,
};

const SOURCES: [Source; 7] = [
    Source {
        name: "heldout-presses",
        folder: "broad-graded",
        about: "presses that no training saw, of the shapes and depths it saw",
        split: SplitOrAll::Split(Split::Test),
    },
    Source {
        name: "heldout-shapes",
        folder: "heldout-graded",
        about: "shapes that no training saw",
        split: SplitOrAll::All,
    },
    REFERENCE,
    Source {
        name: "reference-anew",
        folder: "final-anew",
        about: "the same shapes on the finest mesh in other poses, solved when everything was decided",
        split: SplitOrAll::All,
    },
    Source {
        name: "reference-shapes",
        folder: "final-shapes",
        about: "twelve shapes that no other set has, on the finest mesh, solved when everything was \
                decided",
        split: SplitOrAll::All,
    },
    Source {
        name: "pressed",
        folder: "pressed-graded",
        about: "presses that no training saw: a plate to 7 N, a key, gratings, Braille",
        split: SplitOrAll::Split(Split::Test),
    },
    Source {
        name: "s1",
        folder: "s1-graded",
        about: "presses of the published campaign that no training saw, a plate alone, by the \
                teacher",
        split: SplitOrAll::Split(Split::Test),
    },
];

/// The sets whose presses contact presses once more, from their poses.
const POSED: [&Source; 2] = [&SOURCES[0], &SOURCES[1]];

/// The states of [`POSED`] with the pressure that contact on pixels finds from their poses in place
/// of their own. Those that contact does not settle are left out, since the service flags them.
/// Empty, and says why, without one of the datasets or without the contact model.
pub(super) fn from_poses(
    data: &Path,
    models: &Path,
    canvas: &Canvas,
) -> Result<SampleSet, ExportError> {
    let mut set = SampleSet {
        name: POSES_SET,
        about: String::new(),
        dataset_sha256: None,
        states: Vec::new(),
    };
    let contact = models.join("finger.contact");
    let folders = POSED.map(|source| data.join(source.folder));
    let missing =
        folders.iter().map(|folder| folder.join("manifest.json")).chain([contact.clone()]);
    if let Some(missing) = missing.into_iter().find(|file| !file.is_file()) {
        set.about = format!("not measured: there is no {}", missing.display());
        return Ok(set);
    }
    let models = Models::read(&contact)?;
    let mut left_out = 0;
    for (source, folder) in POSED.into_iter().zip(&folders) {
        let dataset = Dataset::open(folder)?;
        require_same_atlas(
            &folder.display().to_string(),
            dataset.atlas().hash(),
            &canvas.atlas_hash,
        )?;
        models.require_atlas(&dataset, folder)?;
        let maps =
            ContactMaps::of_indentations(&models, &dataset, dataset.indentations(source.split)?)?;
        left_out += maps.left_out;
        let mut states = source.taken_of(&dataset)?.states.into_iter();
        for (k, (press, state)) in maps.press.iter().zip(&maps.state).enumerate() {
            let is_it = |of: &State| (of.indentation as i64, of.number as i64) == (*press, *state);
            let Some(of) = states.by_ref().find(is_it) else { continue };
            let map = &maps.pressure_pa[k * MAP_LEN..][..MAP_LEN];
            let pressure_pa = canvas.skin.indices().iter().map(|&pixel| map[pixel as usize]);
            set.states.push(State { pressure_pa: pressure_pa.collect(), ..of });
        }
    }
    set.about = format!(
        "the states of `heldout-presses` and `heldout-shapes`, with the pressure that contact on \
         pixels finds from their poses; {left_out} that did not settle are left out"
    );
    Ok(set)
}

/// Of what networks learnt, presses like those they are judged by: a mean with the hardest ones, too,
/// would be a worse one.
pub(super) const TRAINING: [Source; 3] = [
    Source { folder: "more-graded", ..LEARNT },
    Source { folder: "broad-graded", ..LEARNT },
    Source { folder: "pressed-graded", ..LEARNT },
];

const LEARNT: Source = Source {
    name: "training",
    folder: "",
    about: "what networks learnt from",
    split: SplitOrAll::Split(Split::Train),
};

/// Reads the sets whose datasets are in `data`; the others come out empty and say why.
pub(super) fn load(data: &Path, canvas: &Canvas) -> Result<Vec<SampleSet>, ExportError> {
    SOURCES.iter().map(|source| source.load(data, canvas)).collect()
}

impl Source {
    pub(super) fn load(&self, data: &Path, canvas: &Canvas) -> Result<SampleSet, ExportError> {
        let folder = data.join(self.folder);
        if !folder.join("manifest.json").is_file() {
            return Ok(SampleSet {
                name: self.name,
                about: format!("not measured: there is no dataset '{}'", self.folder),
                dataset_sha256: None,
                states: Vec::new(),
            });
        }
        let dataset = Dataset::open(&folder)?;
        let what = folder.display().to_string();
        require_same_atlas(&what, dataset.atlas().hash(), &canvas.atlas_hash)?;
        self.taken_of(&dataset)
    }

    fn taken_of(&self, dataset: &Dataset) -> Result<SampleSet, ExportError> {
        let mut set = SampleSet {
            name: self.name,
            about: self.about.to_owned(),
            dataset_sha256: Some(dataset.sha256().to_owned()),
            states: Vec::new(),
        };
        for indentation in dataset.indentations(self.split)? {
            self.take(dataset, indentation, &mut set.states)?;
        }
        Ok(set)
    }

    fn take(
        &self,
        dataset: &Dataset,
        indentation: &IndentationEntry,
        states: &mut Vec<State>,
    ) -> Result<(), ExportError> {
        let shard = dataset.shard(indentation)?;
        let [mut on_skin, mut below] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
        let shown = |patch, map: &[f32]| {
            dataset.maps.raster(patch).indices().iter().map(|&pixel| map[pixel as usize]).collect()
        };
        for (index, depth_mm) in shard.depth_mm.iter().enumerate() {
            dataset.draw_pressure(indentation, &shard, index, &mut on_skin)?;
            dataset.draw_sed(indentation, &shard, index, &mut below)?;
            states.push(State {
                origin: format!("{}, sample {index}", dataset.shard_path(indentation).display()),
                indentation: indentation.id,
                number: index,
                depth_mm: *depth_mm,
                pressure_pa: shown(Patch::Skin, &on_skin),
                sed_j_per_m3: shown(Patch::Interface, &below),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{SampleSet, State};

    #[test]
    fn a_thinned_set_is_spread_over_the_whole() {
        let state = |i: usize| State {
            origin: i.to_string(),
            indentation: i,
            number: 0,
            depth_mm: 1.0,
            pressure_pa: Vec::new(),
            sed_j_per_m3: Vec::new(),
        };
        let set = |n: usize| SampleSet {
            name: "s1",
            about: "x".into(),
            dataset_sha256: None,
            states: (0..n).map(state).collect(),
        };
        let mut large = set(100);
        large.thin(4);
        let kept: Vec<&str> = large.states.iter().map(|s| s.origin.as_str()).collect();
        assert_eq!(kept, ["12", "37", "62", "87"]);
        assert_eq!(large.described().about, "4 of 100 samples: x");
        let mut small = set(3);
        small.thin(4);
        assert_eq!(small.states.len(), 3);
    }
}
