//! The campaign file.

use super::error::SpecError;
use crate::geometry::fingertip::FingertipShape;
use crate::indenter::IndenterError;
use crate::mesh::fingertip::{Density, Order};
use crate::scene::effects::{add_needed, usual};
use crate::scene::finger::sha256_of;
use crate::scene::has_key;
use crate::scene::{
    Biphasic, EffectName, Finger, FingerError, Friction, Geometry, Motion, Origin, Pose, Scene,
    TissueTable,
};
use papilla_sdf::IndenterSpec;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Ranges \[lowest, highest\] of the indenter's orientation, degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseRanges {
    /// Pitch about the lateral axis; positive presses the tip first.
    pub pitch_deg: [f64; 2],
    /// Roll about the finger's axis.
    pub roll_deg: [f64; 2],
    /// Yaw about the indenter's own axis.
    pub yaw_deg: [f64; 2],
}

/// How deep presses go: each has its own deepest state, drawn from a range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthRange {
    /// Range of the deepest state, mm from first touch.
    pub deepest_mm: [f64; 2],
    /// States stored on the way, equally spaced.
    pub states: usize,
}

/// How far indenters slide along the skin once they are as deep as they go.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlideRange {
    /// Range of the length, mm.
    pub length_mm: [f64; 2],
    /// Range of the direction, degrees from the indenter's own x toward its y.
    pub direction_deg: [f64; 2],
    /// States stored on the way, equally spaced.
    pub states: usize,
}

/// One of the indenters of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Candidate {
    /// Name in the manifest.
    pub name: String,
    /// Its indentations are to all indentations as its share is to all shares.
    #[serde(default = "one")]
    pub share: u32,
    /// The indenter.
    pub indenter: IndenterSpec,
    /// Ranges of its orientation, if not the campaign's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseRanges>,
    /// Ranges of its offset, if not the campaign's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<[[f64; 2]; 2]>,
    /// Its depths, if not the campaign's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depths: Option<DepthRange>,
}

fn one() -> u32 {
    1
}

/// A campaign: which presses to solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignSpec {
    /// Name of the campaign.
    pub name: String,
    /// Seed of poses, offsets and depths, and of the split.
    pub seed: u64,
    /// Number of indentations, each with its own pose.
    pub presses: usize,
    /// Depths stored for each indentation, mm from first touch, rising; or else `depths`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub depths_mm: Vec<f64>,
    /// Depths that differ from press to press; or else `depths_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depths: Option<DepthRange>,
    /// Share of the indentations that is held out, 0 to less than 1; or else `test_one_in`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test_fraction: Option<f64>,
    /// Of each so many indentations one is held out, the same ones however many follow; or else
    /// `test_fraction`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test_one_in: Option<usize>,
    /// Density of the mesh; medium if not given.
    #[serde(default)]
    pub density: Density,
    /// Elements and layout of the mesh, as in a scene's geometry: graded if a campaign's file does not
    /// say. Manifests do not name it where it is linear.
    #[serde(default, skip_serializing_if = "Order::is_linear")]
    pub order: Order,
    /// A finger of one's own, as in a scene's geometry: the folder of its `finger.toml`, or its name in
    /// `fingers/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finger: Option<PathBuf>,
    /// Hash of that finger's dimensions and tissues; manifests hold it.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub finger_sha256: Option<String>,
    /// Dimensions of that finger, or the default's.
    #[serde(skip)]
    pub shape: FingertipShape,
    /// Effects, as in a scene: those of [`usual`] and what the tissues need, if the file names none.
    #[serde(default = "usual")]
    pub effects: Vec<EffectName>,
    /// Constants of tissues, as in a scene.
    #[serde(default, skip_serializing_if = "is_default")]
    pub materials: TissueTable,
    /// Friction, as in a scene.
    #[serde(default, skip_serializing_if = "is_default")]
    pub friction: Friction,
    /// The indenter; or else `indenters`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub indenter: Option<IndenterSpec>,
    /// Several indenters; or else `indenter`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub indenters: Vec<Candidate>,
    /// Ranges of the orientation.
    pub pose: PoseRanges,
    /// Ranges of where the indenter's axis meets the skin, mm along its own x and y
    /// from the skin point that a flat plate in its pose would touch first.
    #[serde(default, skip_serializing_if = "is_default")]
    pub offset_mm: [[f64; 2]; 2],
    /// How far indenters slide at their deepest; `None`: not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slide: Option<SlideRange>,
    /// Where the file was: pictures of indenters are relative to this folder.
    #[serde(skip)]
    pub folder: PathBuf,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Most indentations. One process reads a manifest of 0.9 kB for each.
const PRESSES_MAX: usize = 1 << 20;
/// Most indenters of a campaign.
const INDENTERS_MAX: usize = 1000;
/// Most shares of one indenter.
const SHARE_MAX: u32 = 10_000;
/// Most states of one indentation.
const STATES_MAX: usize = 1000;
/// Most indentations of which one is held out.
const TEST_ONE_IN_MAX: usize = 1000;
/// Largest offset, mm: the finger is 25 mm long.
const OFFSET_MAX_MM: f64 = 25.0;
/// Longest slide, mm: the pad is some 12 mm wide.
const SLIDE_MAX_MM: f64 = 10.0;

impl CampaignSpec {
    /// Reads and checks a campaign file.
    ///
    /// # Errors
    /// [`SpecError`] naming the file and line, or the field and what it
    /// may be.
    pub fn read(path: &Path) -> Result<Self, SpecError> {
        let text = papilla_json::read_text(path)
            .map_err(|source| SpecError::Read { path: path.into(), source })?;
        Self::parse(path, &text)
    }

    /// Reads and checks the text of a campaign file; `path` is where it stands, or would.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, SpecError> {
        if has_key(text, "geometry") {
            let message = "is a scene, not a campaign: `fe-datagen explain` and `solve` take it";
            return Err(SpecError::Spec { path: path.into(), message: message.into() });
        }
        let mut spec: Self = toml::from_str(text)
            .map_err(|e| SpecError::Spec { path: path.to_path_buf(), message: e.to_string() })?;
        spec.folder = path.parent().unwrap_or(Path::new("")).into();
        spec.take_finger(text).map_err(|source| SpecError::Finger {
            campaign: spec.name.clone(),
            source: Box::new(source),
        })?;
        if !has_key(text, "effects") {
            add_needed(&mut spec.effects, &spec.materials);
        }
        spec.validate()?;
        spec.take_meshes()?;
        Ok(spec)
    }

    /// Reads the files of meshes that press.
    fn take_meshes(&mut self) -> Result<(), SpecError> {
        let single = self.indenter.iter_mut().map(|indenter| ("", indenter));
        let several = self.indenters.iter_mut().map(|c| (c.name.as_str(), &mut c.indenter));
        for (name, indenter) in single.chain(several) {
            indenter.load(&self.folder).map_err(|error| SpecError::Scene {
                campaign: self.name.clone(),
                indenter: name.to_owned(),
                source: Box::new(IndenterError::from(error).into()),
            })?;
        }
        Ok(())
    }

    /// Reads the finger that the file names; its tissues stand where the file gives none.
    fn take_finger(&mut self, text: &str) -> Result<(), FingerError> {
        let Some(name) = &self.finger else { return Ok(()) };
        let found = Finger::find(name, &self.folder)?;
        if !has_key(text, "materials") {
            self.materials = found.tissue;
        }
        self.finger_sha256 = Some(sha256_of(&found.shape, &self.materials));
        self.shape = found.shape;
        Ok(())
    }

    /// The indenters; a single one is called after its shape.
    pub fn candidates(&self) -> Vec<Candidate> {
        let single = self.indenter.as_ref().map(|indenter| Candidate {
            name: indenter.name().into(),
            share: 1,
            indenter: indenter.clone(),
            pose: None,
            offset_mm: None,
            depths: None,
        });
        single.into_iter().chain(self.indenters.iter().cloned()).collect()
    }

    /// What a candidate's indentations have in common, as a scene.
    pub fn scene(&self, candidate: &Candidate) -> Scene {
        Scene {
            geometry: Geometry::Fingertip {
                density: self.density,
                order: self.order,
                shape: self.shape.clone(),
                finger: self.finger.clone(),
            },
            materials: self.materials.clone(),
            indenter: candidate.indenter.clone(),
            motion: Motion::to_depth(1.0, 1, Pose::default()),
            pressure: None,
            friction: self.friction,
            biphasic: Biphasic::default(),
            contact: None,
            effects: self.effects.clone(),
            outputs: None,
            folder: self.folder.clone(),
            origin: Origin::default(),
        }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`SpecError::Value`] for the first that makes no sense,
    /// [`SpecError::Scene`] for one that a scene could not have either.
    pub fn validate(&self) -> Result<(), SpecError> {
        let require = |ok, field: &str, message| self.require(ok, field, message);
        require(!self.name.trim().is_empty(), "name", "must not be empty".into())?;
        require(
            self.finger.is_some() == self.finger_sha256.is_some(),
            "finger",
            "was not looked for: a campaign that names one is read from its file".into(),
        )?;
        require(
            (1..=PRESSES_MAX).contains(&self.presses),
            "presses",
            format!("is {}, it has to be 1 to {PRESSES_MAX}", self.presses),
        )?;
        self.validate_held_out()?;
        require(
            self.depths_mm.is_empty() != self.depths.is_none(),
            "depths_mm",
            "has to be given, or else depths: one of the two".into(),
        )?;
        let rising = self.depths_mm.windows(2).all(|d| d[0] < d[1]);
        require(
            rising && self.depths_mm.iter().all(|d| d.is_finite() && *d > 0.0),
            "depths_mm",
            format!("is {:?}, it has to be a rising list of depths above 0", self.depths_mm),
        )?;
        self.validate_ranges("", Some(&self.pose), Some(&self.offset_mm), self.depths.as_ref())?;
        self.validate_slide()?;
        require(
            self.indenter.is_some() == self.indenters.is_empty(),
            "indenter",
            "has to be given, or else indenters: one of the two".into(),
        )?;
        require(
            self.indenters.len() <= INDENTERS_MAX,
            "indenters",
            format!("are {}, at most {INDENTERS_MAX}", self.indenters.len()),
        )?;
        for (i, candidate) in self.candidates().iter().enumerate() {
            self.validate_candidate(i, candidate)?;
        }
        Ok(())
    }

    fn require(&self, ok: bool, field: &str, message: String) -> Result<(), SpecError> {
        let campaign = self.name.clone();
        if ok { Ok(()) } else { Err(SpecError::Value { campaign, field: field.into(), message }) }
    }

    fn validate_held_out(&self) -> Result<(), SpecError> {
        match (self.test_fraction, self.test_one_in) {
            (Some(share), None) => self.require(
                (0.0..1.0).contains(&share),
                "test_fraction",
                format!("is {share}, it has to be 0 or more and less than 1"),
            ),
            (None, Some(count)) => self.require(
                (2..=TEST_ONE_IN_MAX).contains(&count),
                "test_one_in",
                format!("is {count}, it has to be 2 to {TEST_ONE_IN_MAX}"),
            ),
            _ => self.require(
                false,
                "test_fraction",
                "has to be given, or else test_one_in: one of the two".into(),
            ),
        }
    }

    fn validate_slide(&self) -> Result<(), SpecError> {
        let Some(SlideRange { length_mm, direction_deg, states }) = self.slide else {
            return Ok(());
        };
        let [low, high] = length_mm;
        self.require(
            0.0 < low && low <= high && high <= SLIDE_MAX_MM,
            "slide.length_mm",
            format!("is [{low}, {high}], it has to rise from above 0 to at most {SLIDE_MAX_MM}"),
        )?;
        let [low, high] = direction_deg;
        self.require(
            -360.0 <= low && low <= high && high <= 360.0,
            "slide.direction_deg",
            format!("is [{low}, {high}], it has to rise within -360 to 360"),
        )?;
        self.require(
            (1..=STATES_MAX).contains(&states),
            "slide.states",
            format!("is {states}, it has to be 1 to {STATES_MAX}"),
        )
    }

    fn validate_candidate(&self, i: usize, c: &Candidate) -> Result<(), SpecError> {
        let table = format!("indenters[{i}].");
        let first = self.indenters.iter().position(|other| other.name == c.name);
        self.require(
            !c.name.trim().is_empty() && first.is_none_or(|j| j == i),
            &format!("{table}name"),
            format!("is '{}', it has to be a name that no other indenter has", c.name),
        )?;
        self.require(
            (1..=SHARE_MAX).contains(&c.share),
            &format!("{table}share"),
            format!("is {}, it has to be 1 to {SHARE_MAX}", c.share),
        )?;
        self.validate_ranges(&table, c.pose.as_ref(), c.offset_mm.as_ref(), c.depths.as_ref())?;
        self.scene(c).validate().map_err(|source| SpecError::Scene {
            campaign: self.name.clone(),
            indenter: c.name.clone(),
            source: Box::new(source),
        })
    }

    fn validate_ranges(
        &self,
        table: &str,
        pose: Option<&PoseRanges>,
        offset_mm: Option<&[[f64; 2]; 2]>,
        depths: Option<&DepthRange>,
    ) -> Result<(), SpecError> {
        let angles = pose.map(|p| {
            [
                ("pose.pitch_deg", p.pitch_deg, 90.0),
                ("pose.roll_deg", p.roll_deg, 180.0),
                ("pose.yaw_deg", p.yaw_deg, 180.0),
            ]
        });
        let offsets = offset_mm.map(|o| o.map(|range| ("offset_mm", range, OFFSET_MAX_MM)));
        for (field, [low, high], limit) in
            angles.into_iter().flatten().chain(offsets.into_iter().flatten())
        {
            self.require(
                -limit <= low && low <= high && high <= limit,
                &format!("{table}{field}"),
                format!("is [{low}, {high}], it has to rise within -{limit} to {limit}"),
            )?;
        }
        let Some(DepthRange { deepest_mm: [low, high], states }) = depths else { return Ok(()) };
        self.require(
            0.0 < *low && low <= high && high.is_finite(),
            &format!("{table}depths.deepest_mm"),
            format!("is [{low}, {high}], it has to rise from above 0"),
        )?;
        self.require(
            (1..=STATES_MAX).contains(states),
            &format!("{table}depths.states"),
            format!("is {states}, it has to be 1 to {STATES_MAX}"),
        )
    }
}
