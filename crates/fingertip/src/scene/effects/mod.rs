//! Effects: what a scene asks for beyond the barest body.
//!
//! The barest body is linear elastic at small strain, one homogeneous soft tissue round a rigid
//! bone under a rigid nail, touched without friction. Each effect is one file that
//! says what it adds, what it needs and how it changes the [`Plan`]; [`EFFECTS`] is
//! the table. What no effect has put into the plan is not assembled.

mod biphasic;
mod elastic_bone;
mod finite_strain;
mod friction;
mod hyperelastic;
mod layers;
mod nail;
mod plane_strain;
mod viscoelastic;

use super::biphasic::SkinFlow;
use super::{Scene, SceneError, TissueTable};
use crate::mesh::fingertip::Parts;
use crate::scene::Census;
use crate::tissue::Tissue;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// An effect.
pub struct Effect {
    /// Name in scenes.
    pub name: &'static str,
    /// What it adds.
    pub adds: &'static str,
    /// What is done instead without it.
    pub without: &'static str,
    /// Effects that it cannot be without.
    pub needs: &'static [&'static str],
    /// Says why a scene cannot have it.
    pub fits: fn(&Scene) -> Result<(), &'static str>,
    /// What it makes the solver assemble or store; 0 in every scene without it.
    pub state: fn(&Census) -> usize,
    /// What `state` counts.
    pub state_is: &'static str,
    /// Puts it into a plan.
    pub switch_on: fn(&Scene, &mut Plan),
}

/// Every effect, in the order in which they change a plan.
pub const EFFECTS: [&Effect; 9] = [
    &finite_strain::EFFECT,
    &layers::EFFECT,
    &hyperelastic::EFFECT,
    &viscoelastic::EFFECT,
    &biphasic::EFFECT,
    &friction::EFFECT,
    &elastic_bone::EFFECT,
    &nail::EFFECT,
    &plane_strain::EFFECT,
];

/// Law of soft tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Hooke, small strain.
    Linear,
    /// Neo-Hooke.
    NeoHookean,
    /// Ogden where the tissue has one, neo-Hooke elsewhere.
    Ogden,
}

/// What is going to be simulated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Law of every tissue.
    pub law: Law,
    /// Whose constants each tissue takes, by [`Tissue::index`].
    pub tissues: [Tissue; Tissue::ALL.len()],
    /// Whether tissues with a Prony series relax.
    pub relaxes: bool,
    /// What the skin does to the fluid of tissues that have some; `None` is no fluid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fluid: Option<SkinFlow>,
    /// Solid parts that are meshed and deform.
    pub parts: Parts,
    /// Coulomb coefficient; 0 is no friction.
    pub friction: f64,
    /// Whether the body is a plane section.
    pub plane_strain: bool,
}

impl Plan {
    /// The barest body.
    #[must_use]
    pub fn bare() -> Self {
        use Tissue::{Bone, Nail, Subcutaneous};
        Self {
            law: Law::Linear,
            tissues: [Subcutaneous, Subcutaneous, Subcutaneous, Nail, Bone],
            relaxes: false,
            fluid: None,
            parts: Parts::default(),
            friction: 0.0,
            plane_strain: false,
        }
    }

    /// What the surface-pressure study's analysis has: large strain and layers.
    #[must_use]
    pub fn usual() -> Self {
        Self { law: Law::NeoHookean, tissues: Tissue::ALL, ..Self::bare() }
    }

    /// The plan of a scene: the barest body and what its effects add.
    ///
    /// # Errors
    /// [`SceneError::Effect`] for an effect that the scene cannot have, or that
    /// lacks another one; [`SceneError::Unnamed`] for one that its tissues need.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        if let Some(missing) = scene.materials.needs.iter().find(|e| !scene.has(e)) {
            return Err(SceneError::Unnamed { effect: missing.clone() });
        }
        let mut plan = Self::bare();
        for effect in EFFECTS.iter().filter(|e| scene.has(e.name)) {
            let refuse = |why: String| Err(SceneError::Effect { effect: effect.name, why });
            if let Some(missing) = effect.needs.iter().find(|n| !scene.has(n)) {
                return refuse(format!("needs '{missing}': name both or neither"));
            }
            if let Err(why) = (effect.fits)(scene) {
                return refuse(why.into());
            }
            (effect.switch_on)(scene, &mut plan);
        }
        Ok(plan)
    }
}

/// An effect by name: its place in [`EFFECTS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct EffectName(usize);

impl EffectName {
    /// The name.
    #[must_use]
    pub const fn as_str(&self) -> &'static str {
        EFFECTS[self.0].name
    }

    /// The effect of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        EFFECTS.iter().position(|e| e.name == name).map(Self)
    }
}

impl JsonSchema for EffectName {
    fn schema_name() -> Cow<'static, str> {
        "Effect".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let one = |e: &Effect| json_schema!({ "const": e.name, "description": e.adds });
        json_schema!({ "oneOf": EFFECTS.map(one) })
    }
}

impl TryFrom<String> for EffectName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::named(&name).ok_or_else(|| {
            let known: Vec<_> = EFFECTS.iter().map(|e| e.name).collect();
            let meant = papilla_json::meant(&name, known.iter().copied());
            format!("unknown effect '{name}'{meant}; there are: {}", known.join(", "))
        })
    }
}

impl From<EffectName> for String {
    fn from(name: EffectName) -> Self {
        name.as_str().into()
    }
}

/// The effects of a scene that names none: what the surface-pressure study's analysis has.
#[must_use]
pub fn usual() -> Vec<EffectName> {
    let of = |e: &Effect| EFFECTS.iter().position(|known| known.name == e.name).map(EffectName);
    [&finite_strain::EFFECT, &layers::EFFECT].into_iter().filter_map(of).collect()
}

/// Adds the effects that constants of tissues need and that `effects` lacks. Names of no effect are left
/// to [`Scene::validate`].
pub fn add_needed(effects: &mut Vec<EffectName>, tissues: &TissueTable) {
    for needed in tissues.needs.iter().filter_map(|name| EffectName::named(name)) {
        if !effects.contains(&needed) {
            effects.push(needed);
        }
    }
}

/// For an effect that every scene can have.
fn always(_: &Scene) -> Result<(), &'static str> {
    Ok(())
}
