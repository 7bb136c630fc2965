//! The tables of a finger's file, and how it is written.

use super::{FIELDS, Finger, SKIN_FILE};
use crate::geometry::fingertip::{FingertipShape, LayerMap, SkinOffset, SurfaceParameter};
use crate::materials::MaterialSpec;
use crate::scene::materials::{MaterialSet, TissueTable};
use crate::tissue::Tissue;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// Where a finger is from; for people, never checked.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Source {
    /// Whose finger it is, or what it stands for.
    pub who: String,
    /// The file that it was fitted to.
    pub file: String,
    /// Unit of lengths in that file.
    pub unit: String,
    /// Day, as 2026-01-31.
    pub date: String,
    /// Licence of the file.
    pub licence: String,
}

/// A finger's file.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FingerFile {
    shape: Shape,
    layers: Layers,
    bone: Bone,
    nail: Nail,
    tissue: TissueTable,
    source: Source,
}

/// Declares a table whose keys are fields of [`FingertipShape`], with its defaults.
macro_rules! table {
    ($name:ident { $($key:ident: $of:ident: $type:ty,)+ } $(, $more:ident: $more_type:ty)?) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields, default)]
        struct $name {
            $($key: $type,)+
            $($more: $more_type,)?
        }

        impl Default for $name {
            fn default() -> Self {
                let usual = FingertipShape::default();
                Self { $($key: usual.$of,)+ $($more: Default::default(),)? }
            }
        }
    };
}

table!(Shape {
    length_mm: length_mm: f64,
    width_mm: width_mm: f64,
    height_mm: height_mm: f64,
    cap_length_mm: cap_length_mm: f64,
    cap_exponent: cap_exponent: f64,
    crease_depth_mm: crease_depth_mm: f64,
}, skin: Option<PathBuf>);

/// Thickness of a layer.
#[derive(Clone, Debug, PartialEq)]
pub enum Thickness {
    /// Everywhere, mm.
    Number(f64),
    /// Over (u, v).
    Map(LayerMap),
}

impl Thickness {
    /// The thickness in the middle of the pad, mm, and the map.
    #[must_use]
    pub fn parts(self) -> (f64, Option<Arc<LayerMap>>) {
        match self {
            Self::Number(mm) => (mm, None),
            Self::Map(map) => {
                (map.at(SurfaceParameter::Body([0.0, -1.0], 0.0)), Some(Arc::new(map)))
            }
        }
    }
}

impl<'de> Deserialize<'de> for Thickness {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Thickness;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number of mm, or a map: rows of numbers over v and u")
            }

            fn visit_f64<E: serde::de::Error>(self, mm: f64) -> Result<Thickness, E> {
                Ok(Thickness::Number(mm))
            }

            fn visit_i64<E: serde::de::Error>(self, mm: i64) -> Result<Thickness, E> {
                Ok(Thickness::Number(mm as f64))
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(
                self,
                rows: A,
            ) -> Result<Thickness, A::Error> {
                let rows = Vec::deserialize(serde::de::value::SeqAccessDeserializer::new(rows))?;
                LayerMap::new(rows).map(Thickness::Map).map_err(serde::de::Error::custom)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Layers {
    epidermis_mm: Thickness,
    dermis_mm: Thickness,
}

impl Default for Layers {
    fn default() -> Self {
        let FingertipShape { epidermis_mm, dermis_mm, .. } = FingertipShape::default();
        Self {
            epidermis_mm: Thickness::Number(epidermis_mm),
            dermis_mm: Thickness::Number(dermis_mm),
        }
    }
}

table!(Bone {
    tip_mm: bone_tip_mm: f64,
    cap_mm: bone_cap_mm: f64,
    offset_mm: bone_offset_mm: f64,
    tuft_mm: bone_tuft_mm: [f64; 2],
    waist_mm: bone_waist_mm: [f64; 2],
    base_mm: bone_base_mm: [f64; 2],
    waist_at: bone_waist_at: f64,
    cortex_mm: bone_cortex_mm: f64,
});

table!(Nail {
    size_mm: nail_mm: [f64; 2],
    tip_mm: nail_tip_mm: f64,
    thickness_mm: nail_thickness_mm: f64,
});

impl FingerFile {
    /// The file of the skin's offsets, relative to the finger's folder.
    pub(super) fn skin(&self) -> Option<PathBuf> {
        self.shape.skin.clone()
    }

    pub(super) fn into_finger(self, offset: Option<Arc<SkinOffset>>) -> Finger {
        let Self { shape: s, layers, bone, nail, tissue, source } = self;
        let (epidermis_mm, epidermis_map) = layers.epidermis_mm.parts();
        let (dermis_mm, dermis_map) = layers.dermis_mm.parts();
        let shape = FingertipShape {
            length_mm: s.length_mm,
            width_mm: s.width_mm,
            height_mm: s.height_mm,
            cap_length_mm: s.cap_length_mm,
            cap_exponent: s.cap_exponent,
            crease_depth_mm: s.crease_depth_mm,
            epidermis_mm,
            dermis_mm,
            bone_tip_mm: bone.tip_mm,
            bone_cap_mm: bone.cap_mm,
            bone_offset_mm: bone.offset_mm,
            bone_tuft_mm: bone.tuft_mm,
            bone_waist_mm: bone.waist_mm,
            bone_base_mm: bone.base_mm,
            bone_waist_at: bone.waist_at,
            nail_mm: nail.size_mm,
            nail_tip_mm: nail.tip_mm,
            nail_thickness_mm: nail.thickness_mm,
            bone_cortex_mm: bone.cortex_mm,
            offset,
            epidermis_map,
            dermis_map,
        };
        Finger { shape, tissue, source }
    }
}

/// What is said above the first number.
const HEAD: &str = "\
# A finger: `fe-datagen finger explain` reads it back, docs/guides/fingers.md says what follows from it.
# Units stand in the names of the keys. A key that is left out has its default.
";

/// The text of a finger's file.
pub(super) fn written(finger: &Finger) -> String {
    let usual = FingertipShape::default();
    let mut text = String::from(HEAD);
    let mut table = "";
    for field in &FIELDS {
        if field.table != table {
            table = field.table;
            text += &format!("\n[{table}]\n");
            if let ("shape", Some(_)) = (table, &finger.shape.offset) {
                text += "# How far the skin lies from these dimensions, fitted to a surface.\n";
                text += &format!("skin = \"{SKIN_FILE}\"\n");
            }
        }
        text += &format!(
            "# {}; {}, default {}\n{} = {}\n",
            field.about,
            field.range_words(),
            field.written(&usual),
            field.key,
            field.written(&finger.shape)
        );
    }
    text += "\n# Constants of the tissues, as in a scene's [materials]: \"papers\" or \"people\", and tables such\n\
             # as [tissue.dermis] for what is measured. A scene with [materials] of its own takes those.\n";
    text += &tissue(&finger.tissue);
    text += "\n# For people; no number depends on it.\n[source]\n";
    let Source { who, file, unit, date, licence } = &finger.source;
    for (key, value) in
        [("who", who), ("file", file), ("unit", unit), ("date", date), ("licence", licence)]
    {
        text += &format!("{key} = {}\n", toml::Value::String(value.clone()));
    }
    text
}

/// The table of tissues: the set that it is, or else what differs from the nearest.
fn tissue(table: &TissueTable) -> String {
    let differing = |set: MaterialSet| -> Vec<(Tissue, &MaterialSpec)> {
        let usual = set.table();
        let own = Tissue::ALL.iter().map(|&t| (t, table.of(t)));
        own.filter(|(t, spec)| *spec != usual.of(*t)).collect()
    };
    let (papers, people) = (differing(MaterialSet::Papers), differing(MaterialSet::People));
    let (name, set, own) = match people.len() < papers.len() {
        true => ("people", MaterialSet::People, people),
        false => ("papers", MaterialSet::Papers, papers),
    };
    let mut text = format!("[tissue]\nset = \"{name}\"\n");
    if let Some(tension) = table.skin_tension_n_per_mm {
        text +=
            &format!("# Tension of the skin at rest, N/mm.\nskin_tension_n_per_mm = {tension:?}\n");
    }
    if table.needs != set.table().needs {
        text += &format!(
            "# Effects with which these constants were fitted: whoever presses the finger has to name them.\n\
             needs = {:?}\n",
            table.needs
        );
    }
    for (tissue, spec) in own {
        let inner = toml::Table::try_from(spec).unwrap_or_default();
        let outer = toml::Table::from_iter([(tissue.name().to_owned(), toml::Value::Table(inner))]);
        let whole = toml::Table::from_iter([("tissue".to_owned(), toml::Value::Table(outer))]);
        text += &format!("\n{}", toml::to_string(&whole).unwrap_or_default());
    }
    text
}
