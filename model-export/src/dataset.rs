//! A dataset for the evaluation of models: its maps, the indenter of each simulation, and the
//! pixels over which errors are taken.

use crate::ExportError;
use crate::metrics::Ground;
use crate::split::SplitOrAll;
use papilla_dataset::{Field, IndentationEntry, Maps, Shard};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::scene::Finger;
use papilla_proto::{
    atlas::{Atlas, Patch},
    sdf::IndenterSpec,
};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// What a campaign says of its mesh and indenters.
#[derive(Debug, Default, Deserialize)]
struct Campaign {
    #[serde(default)]
    name: String,
    #[serde(default)]
    density: String,
    /// Absent: linear.
    order: Option<String>,
    indenter: Option<IndenterSpec>,
    #[serde(default)]
    indenters: Vec<NamedIndenter>,
    friction: Option<Friction>,
    /// Absent: the default finger.
    finger_sha256: Option<String>,
}

#[derive(Debug, Deserialize)]
struct Friction {
    coefficient: f64,
}

#[derive(Debug, Deserialize)]
struct NamedIndenter {
    name: String,
    indenter: IndenterSpec,
}

/// A dataset whose manifest and atlas have been read and agree.
#[derive(Debug)]
pub struct Dataset {
    files: papilla_dataset::Dataset,
    campaign: Campaign,
    /// Of the finger that pressed; none if it is one of its own that has not been named.
    shape: Option<FingertipShape>,
    /// Where errors are taken.
    pub ground: Ground,
    /// Draws pressure and SED.
    pub maps: Maps,
}

impl Dataset {
    /// Opens the dataset in `folder`; shards are read by [`Dataset::shard`].
    ///
    /// # Errors
    /// [`ExportError::Dataset`], [`ExportError::DatasetFile`] where the campaign has an unknown indenter.
    pub fn open(folder: &Path) -> Result<Self, ExportError> {
        let files = papilla_dataset::Dataset::open(folder)?;
        let campaign = match &files.manifest().campaign {
            serde_json::Value::Null => Campaign::default(),
            campaign => Campaign::deserialize(campaign).map_err(|error| {
                let path = folder.join("manifest.json");
                ExportError::DatasetFile { path, reason: format!("its campaign: {error}") }
            })?,
        };
        let maps = Maps::read(folder, files.atlas())?;
        let ground = Ground::new(files.atlas(), maps.raster(Patch::Interface));
        let shape = campaign.finger_sha256.is_none().then(FingertipShape::default);
        Ok(Self { files, campaign, shape, ground, maps })
    }

    /// Takes the dimensions of the finger that it was solved on, from the finger's folder: where an
    /// indenter first touches depends on them.
    ///
    /// # Errors
    /// [`ExportError::Finger`] if it is no finger or another one.
    pub fn on_finger(mut self, folder: &Path) -> Result<Self, ExportError> {
        let refused = |reason: String| ExportError::Finger { path: folder.into(), reason };
        let finger = Finger::read(folder).map_err(|error| refused(error.to_string()))?;
        let (found, due) = (finger.sha256(), self.campaign.finger_sha256.as_deref());
        match due {
            Some(due) if due == found => {}
            None if found == Finger::usual().sha256() => {}
            _ => {
                let solved = due.map_or_else(
                    || "the default finger".to_owned(),
                    |due| format!("a finger whose hash is {due}"),
                );
                return Err(refused(format!(
                    "the hash of its dimensions and tissues is {found}, but {} was solved on {solved}",
                    self.folder().display()
                )));
            }
        }
        self.shape = Some(finger.shape);
        Ok(self)
    }

    /// Hash of dimensions and tissues of the finger that it was solved on; none: the default one.
    #[must_use]
    pub fn finger_sha256(&self) -> Option<&str> {
        self.campaign.finger_sha256.as_deref()
    }

    /// Dimensions of the finger that it was solved on.
    ///
    /// # Errors
    /// [`ExportError::DatasetFile`] if it was solved on a finger of its own, which has not been named.
    pub fn shape(&self) -> Result<&FingertipShape, ExportError> {
        self.shape.as_ref().ok_or_else(|| ExportError::DatasetFile {
            path: self.folder().join("manifest.json"),
            reason: "it was solved on another finger than the default one, which the command has \
                     to know: name its folder with --finger"
                .into(),
        })
    }

    /// The folder it is in.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.files.folder()
    }

    /// The atlas of all its maps.
    #[must_use]
    pub fn atlas(&self) -> &Atlas {
        self.files.atlas()
    }

    /// SHA-256 that names the dataset.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.files.manifest().dataset_sha256
    }

    /// Name of its campaign.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.campaign.name
    }

    /// Mesh that it was solved on, such as `medium-graded`.
    #[must_use]
    pub fn mesh(&self) -> String {
        let Campaign { density, order, .. } = &self.campaign;
        format!("{density}-{}", order.as_deref().unwrap_or("linear"))
    }

    /// What pressed in an indentation; none if the manifest does not say.
    #[must_use]
    pub fn indenter(&self, indentation: &IndentationEntry) -> Option<&IndenterSpec> {
        let Campaign { indenter, indenters, .. } = &self.campaign;
        let named = indenters.iter().find(|other| other.name == indentation.indenter);
        named.map(|named| &named.indenter).or(indenter.as_ref())
    }

    /// Coulomb's coefficient of friction between skin and indenters; none without friction.
    #[must_use]
    pub fn friction(&self) -> Option<f64> {
        self.campaign.friction.as_ref().map(|friction| friction.coefficient)
    }

    /// Effects that the solver modelled.
    #[must_use]
    pub fn effects(&self) -> &[String] {
        &self.files.manifest().effects
    }

    /// The indentations of a split, by rising id.
    ///
    /// # Errors
    /// [`ExportError::EmptySplit`] if there are none.
    pub fn indentations(
        &self,
        split: impl Into<SplitOrAll>,
    ) -> Result<Vec<&IndentationEntry>, ExportError> {
        let split = split.into();
        let found: Vec<_> = match split {
            SplitOrAll::Split(split) => self.files.of_split(split).collect(),
            SplitOrAll::All => self.every_indentation(),
        };
        if found.iter().all(|indentation| indentation.samples == 0) {
            let path = self.folder().join("manifest.json");
            return Err(ExportError::EmptySplit { path, split });
        }
        Ok(found)
    }

    /// All indentations, of whichever split, by rising id.
    #[must_use]
    pub fn every_indentation(&self) -> Vec<&IndentationEntry> {
        self.files.manifest().presses.iter().collect()
    }

    /// Path of the shard of an indentation.
    #[must_use]
    pub fn shard_path(&self, indentation: &IndentationEntry) -> PathBuf {
        self.files.shard_path(indentation)
    }

    /// Reads the shard of an indentation and checks its hash, shapes and values.
    ///
    /// # Errors
    /// [`ExportError::Dataset`].
    pub fn shard(&self, indentation: &IndentationEntry) -> Result<Shard, ExportError> {
        Ok(self.files.shard(indentation)?)
    }

    /// Draws the pressure of a sample of an indentation on the skin, Pa; 224 x 224.
    ///
    /// # Errors
    /// [`ExportError::DatasetFile`] where a pixel lies in no cell.
    pub fn draw_pressure(
        &self,
        indentation: &IndentationEntry,
        shard: &Shard,
        sample: usize,
        map: &mut [f32],
    ) -> Result<(), ExportError> {
        self.draw(indentation, Field::Pressure, shard, sample, map)
    }

    /// Draws its SED on the interface, J/m3.
    ///
    /// # Errors
    /// As [`Self::draw_pressure`].
    pub fn draw_sed(
        &self,
        indentation: &IndentationEntry,
        shard: &Shard,
        sample: usize,
        map: &mut [f32],
    ) -> Result<(), ExportError> {
        self.draw(indentation, Field::SedDermis, shard, sample, map)
    }

    pub(crate) fn draw(
        &self,
        indentation: &IndentationEntry,
        field: Field,
        shard: &Shard,
        sample: usize,
        map: &mut [f32],
    ) -> Result<(), ExportError> {
        self.maps.of(shard).draw(field, sample, map).map_err(|error| {
            let path = self.shard_path(indentation);
            ExportError::DatasetFile { path, reason: error.to_string() }
        })
    }
}
