//! What a session agreed to, in the words of a service.

use papilla_codec::{Output, scale_of};
use papilla_proto::{
    FingerTerms, MAP_SIDE_PX, PROTOCOL_VERSION, Ready,
    contact::{DEFAULT_FINGER, MethodError},
};
use papilla_session_effects::Effects;

use super::{Part, Session};

impl Part {
    fn infer_us(&self) -> u64 {
        u64::try_from(self.infer.as_micros()).unwrap_or(u64::MAX)
    }
}

impl Session {
    fn part(&self, finger: usize) -> &Part {
        &self.parts[self.part_of[finger]]
    }

    fn sed_scale(&self, part: &Part) -> f32 {
        let output = Output::Samples(self.answer_sample_type());
        scale_of(output, part.of.model.info().sed_max_j_per_m3)
    }

    fn expected_error(&self, finger: usize) -> Option<MethodError> {
        let errors = self.part(finger).model.bundle.contact_errors.as_ref()?;
        errors.of(self.hand.method_of(finger)?).cloned()
    }

    /// The terms of a finger, as a service says them.
    fn finger_terms(&self, finger: usize) -> FingerTerms {
        let part = self.part(finger);
        let info = part.of.model.info();
        let announced = self.hello.fingers.as_ref().and_then(|fingers| fingers.get(finger));
        FingerTerms {
            name: announced.map_or(DEFAULT_FINGER, |announced| announced.name()).to_owned(),
            tier: info.name.clone(),
            tier_number: self.part_of[finger] as u16,
            trained_on: None,
            atlas_hash: info.atlas_hash.clone(),
            vertices: part.model.bundle.atlas.vertex_count() as u32,
            pressure_max_pa: info.pressure_max_pa,
            sed_scale_j_per_m3: self.sed_scale(part),
            predicted_latency_us: part.infer_us(),
            method: self.hand.method_of(finger),
            expected_error: self.expected_error(finger),
            units: self.effects.get(finger).and_then(Effects::units).map(<[_]>::to_vec),
        }
    }

    /// What the session agreed to, as a service says it. Latency is that of one run of the network.
    #[must_use]
    pub fn ready(&self) -> Ready {
        let hand = &self.hand;
        let Part { model, of, .. } = self.part(0);
        let info = of.model.info();
        let method = hand.method();
        let has_names = self.hello.fingers.iter().flatten().any(|finger| finger.name.is_some());
        let names = || self.parts.iter().map(|part| part.of.model.info().name.clone()).collect();
        let effects = self.effects.first();
        let unlearnt = model.unlearnt(of, self.hello.input.unwrap_or_default());
        let unlearnt = unlearnt.filter(|_| self.shows_sed());
        Ready {
            version: PROTOCOL_VERSION.into(),
            session: 0,
            tier: info.name.clone(),
            effects: info.effects.clone(),
            atlas_hash: info.atlas_hash.clone(),
            predicted_latency_us: self.parts.iter().map(Part::infer_us).max().unwrap_or_default(),
            budget_us: None,
            meets_budget: None,
            width: MAP_SIDE_PX as u32,
            height: MAP_SIDE_PX as u32,
            sample_type: self.hello.sample_type,
            pressure_max_pa: info.pressure_max_pa,
            sed_scale_j_per_m3: self.sed_scale(self.part(0)),
            tier_number: 0,
            tier_names: (self.parts.len() > 1).then(names),
            answer_sample_type: self.answer_sample_type(),
            session_effects: effects.map(|e| e.names().to_vec()).unwrap_or_default(),
            sections: self.sections(),
            units: effects.and_then(Effects::units).map(<[_]>::to_vec),
            state: None,
            vertices: model.bundle.atlas.vertex_count() as u32,
            fingers: hand.fingers().len() as u32,
            contact_us: None,
            finger_terms: has_names
                .then(|| (0..hand.fingers().len()).map(|n| self.finger_terms(n)).collect()),
            method,
            expected_error: self.expected_error(0),
            warnings: hand.warnings().iter().cloned().chain(unlearnt).collect(),
        }
    }
}
