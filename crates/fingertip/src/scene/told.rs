//! A scene, written: an indenter only where one presses.

use super::{
    Biphasic, ContactRule, EffectName, Friction, Geometry, IndenterSpec, Motion, Output, Pressure,
    Scene, TissueTable,
};
use serde::{Serialize, Serializer};

#[derive(Serialize)]
struct Told<'a> {
    geometry: &'a Geometry,
    materials: &'a TissueTable,
    /// Pressure takes its place.
    #[serde(skip_serializing_if = "Option::is_none")]
    indenter: Option<&'a IndenterSpec>,
    #[serde(skip_serializing_if = "Motion::is_still")]
    motion: &'a Motion,
    #[serde(skip_serializing_if = "Option::is_none")]
    pressure: &'a Option<Pressure>,
    friction: &'a Friction,
    #[serde(skip_serializing_if = "Biphasic::is_default")]
    biphasic: &'a Biphasic,
    #[serde(skip_serializing_if = "Option::is_none")]
    contact: Option<ContactRule>,
    effects: &'a [EffectName],
    #[serde(skip_serializing_if = "Option::is_none")]
    outputs: &'a Option<Vec<Output>>,
}

impl Serialize for Scene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let told = Told {
            geometry: &self.geometry,
            materials: &self.materials,
            indenter: self.pressure.is_none().then_some(&self.indenter),
            motion: &self.motion,
            pressure: &self.pressure,
            friction: &self.friction,
            biphasic: &self.biphasic,
            contact: self.contact,
            effects: &self.effects,
            outputs: &self.outputs,
        };
        told.serialize(serializer)
    }
}
