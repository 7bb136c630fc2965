//! The numbers of a finger's file: each with its unit, its default, its range and what it is.

use crate::geometry::fingertip::{FingertipShape, LayerMap};

/// A number, or several that belong together.
pub struct Field {
    /// Table of the file.
    pub table: &'static str,
    /// Key in the table.
    pub key: &'static str,
    /// The field of [`FingertipShape`] that it is.
    pub shape: &'static str,
    /// Unit; 1 for a number without.
    pub unit: &'static str,
    /// Least and largest value of any person, with room.
    pub range: [f64; 2],
    /// What it is.
    pub about: &'static str,
}

impl Field {
    /// Its numbers in a shape.
    #[must_use]
    pub fn values(&self, shape: &FingertipShape) -> Vec<f64> {
        let s = shape;
        match self.shape {
            "length_mm" => vec![s.length_mm],
            "width_mm" => vec![s.width_mm],
            "height_mm" => vec![s.height_mm],
            "cap_length_mm" => vec![s.cap_length_mm],
            "cap_exponent" => vec![s.cap_exponent],
            "crease_depth_mm" => vec![s.crease_depth_mm],
            "epidermis_mm" | "dermis_mm" => match self.map(s) {
                Some(map) => map.rows_mm().concat(),
                None if self.shape == "dermis_mm" => vec![s.dermis_mm],
                None => vec![s.epidermis_mm],
            },
            "bone_tip_mm" => vec![s.bone_tip_mm],
            "bone_cap_mm" => vec![s.bone_cap_mm],
            "bone_offset_mm" => vec![s.bone_offset_mm],
            "bone_tuft_mm" => s.bone_tuft_mm.to_vec(),
            "bone_waist_mm" => s.bone_waist_mm.to_vec(),
            "bone_base_mm" => s.bone_base_mm.to_vec(),
            "bone_waist_at" => vec![s.bone_waist_at],
            "bone_cortex_mm" => vec![s.bone_cortex_mm],
            "nail_mm" => s.nail_mm.to_vec(),
            "nail_tip_mm" => vec![s.nail_tip_mm],
            _ => vec![s.nail_thickness_mm],
        }
    }

    /// The map of a layer that has one.
    #[must_use]
    pub fn map<'a>(&self, shape: &'a FingertipShape) -> Option<&'a LayerMap> {
        match self.shape {
            "epidermis_mm" => shape.epidermis_map.as_deref(),
            "dermis_mm" => shape.dermis_map.as_deref(),
            _ => None,
        }
    }

    /// The values for people: of a map, its least and greatest.
    #[must_use]
    pub fn shown(&self, shape: &FingertipShape) -> String {
        if self.map(shape).is_none() {
            return self.written(shape);
        }
        let values = self.values(shape);
        let [low, high] = [
            values.iter().copied().fold(f64::INFINITY, f64::min),
            values.iter().copied().fold(0.0, f64::max),
        ];
        format!("map, {low:?} to {high:?}")
    }

    /// As the file names it.
    #[must_use]
    pub fn dotted(&self) -> String {
        format!("{}.{}", self.table, self.key)
    }

    /// The values as TOML.
    #[must_use]
    pub fn written(&self, shape: &FingertipShape) -> String {
        if let Some(map) = self.map(shape) {
            let rows = map.rows_mm().iter().map(|row| format!("    {row:?},\n"));
            return format!("[\n{}]", rows.collect::<String>());
        }
        match self.values(shape)[..] {
            [one] => format!("{one:?}"),
            ref several => format!("{several:?}"),
        }
    }

    /// The range in words.
    #[must_use]
    pub fn range_words(&self) -> String {
        let [low, high] = self.range;
        let unit = if self.unit == "1" { String::new() } else { format!(" {}", self.unit) };
        format!("{low} to {high}{unit}")
    }
}

const fn field(
    [table, key, shape, unit]: [&'static str; 4],
    range: [f64; 2],
    about: &'static str,
) -> Field {
    Field { table, key, shape, unit, range, about }
}

/// Every number, in the order of the file.
pub const FIELDS: [Field; 19] = [
    field(
        ["shape", "length_mm", "length_mm", "mm"],
        [10.0, 45.0],
        "from the tip to the plane where the model ends",
    ),
    field(
        ["shape", "width_mm", "width_mm", "mm"],
        [7.0, 32.0],
        "width of the thickest section of the pulp",
    ),
    field(["shape", "height_mm", "height_mm", "mm"], [5.0, 26.0], "height of that section"),
    field(
        ["shape", "cap_length_mm", "cap_length_mm", "mm"],
        [3.0, 25.0],
        "from the tip to that section",
    ),
    field(
        ["shape", "cap_exponent", "cap_exponent", "1"],
        [1.5, 4.0],
        "profile of the tip: 2 is an ellipsoid, more is blunter",
    ),
    field(
        ["shape", "crease_depth_mm", "crease_depth_mm", "mm"],
        [0.0, 6.0],
        "how far the palmar side rises from that section to the end",
    ),
    field(
        ["layers", "epidermis_mm", "epidermis_mm", "mm"],
        [0.05, 1.5],
        "thickness of the epidermis",
    ),
    field(["layers", "dermis_mm", "dermis_mm", "mm"], [0.2, 3.0], "thickness of the dermis"),
    field(
        ["bone", "tip_mm", "bone_tip_mm", "mm"],
        [0.8, 15.0],
        "from the finger's tip to the bone's",
    ),
    field(["bone", "cap_mm", "bone_cap_mm", "mm"], [0.8, 15.0], "length of the bone's rounded end"),
    field(
        ["bone", "offset_mm", "bone_offset_mm", "mm"],
        [-4.0, 6.0],
        "how far its axis lies towards the nail",
    ),
    field(["bone", "tuft_mm", "bone_tuft_mm", "mm"], [1.5, 20.0], "width and height at the tuft"),
    field(
        ["bone", "waist_mm", "bone_waist_mm", "mm"],
        [1.5, 20.0],
        "width and height at the waist",
    ),
    field(["bone", "base_mm", "bone_base_mm", "mm"], [1.5, 25.0], "width and height at the base"),
    field(
        ["bone", "waist_at", "bone_waist_at", "1"],
        [0.1, 0.9],
        "where the waist is: part of the bone's length from the base",
    ),
    field(
        ["bone", "cortex_mm", "bone_cortex_mm", "mm"],
        [0.2, 3.0],
        "thickness of the cortex, for the effect elastic_bone",
    ),
    field(["nail", "size_mm", "nail_mm", "mm"], [2.0, 25.0], "width and length of the nail plate"),
    field(
        ["nail", "tip_mm", "nail_tip_mm", "mm"],
        [0.1, 12.0],
        "from the finger's tip to the plate's free edge",
    ),
    field(
        ["nail", "thickness_mm", "nail_thickness_mm", "mm"],
        [0.1, 2.0],
        "thickness of the plate, for the effect nail",
    ),
];
