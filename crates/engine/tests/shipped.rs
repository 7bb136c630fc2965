//! Maps that no indentation makes, through every shipped model: each is
//! answered by a map that is finite,
//! not negative and empty outside of the interface, or refused by name; and the next is answered
//! as if nothing had been.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod common;

use common::backends;
use papilla_engine::{
    Backend, Card, EngineError, MAP_LEN, MAP_SIDE_PX, Session,
    card::Index,
    error_law::{ErrorLaws, Way},
    load_with,
};
use papilla_proto::{
    MapError, PressureRange, SampleType,
    atlas::{Atlas, Patch, Raster},
    contact::ContactMethod,
    effects::OutOfRange,
};
use std::fs;

fn read(name: &str) -> Vec<u8> {
    fs::read(format!("{}/../../models/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn text(name: &str) -> String {
    String::from_utf8(read(name)).unwrap()
}

/// The pixels of both patches.
fn masks() -> [Vec<bool>; 2] {
    let atlas = Atlas::from_json(&text("atlas.json")).unwrap();
    Patch::ALL.map(|patch| Raster::new(&atlas, patch).mask().to_vec())
}

/// In tract's own way a network on maps takes several times as long, which no answer shows.
#[test]
fn every_network_on_maps_is_evaluated_by_rows() {
    let names = Index::from_json(&text("index.json")).unwrap().models;
    let mut found = 0;
    for name in names {
        let card = Card::from_json(&text(&format!("{name}.json"))).unwrap();
        let model = load_with(Backend::Tract, &read(&format!("{name}.onnx")), Some(&card)).unwrap();
        let (info, members) = (model.info(), card.training.get("mean_of").is_some());
        if info.network["kind"] == "map_net" || members {
            assert!(info.backend.ends_with("by rows"), "{name}: {}", info.backend);
            found += 1;
        }
    }
    assert!(found >= 6, "{found} networks on maps");
}

/// The laws of errors are of the models and the contact model that ship.
#[test]
fn errors_are_stated_of_what_ships() {
    let laws = ErrorLaws::from_json(&text("errors.json")).unwrap();
    assert_eq!(laws.atlas_hash, Atlas::from_json(&text("atlas.json")).unwrap().hash());
    let contact: serde_json::Value = serde_json::from_str(&text("contact.json")).unwrap();
    assert_eq!(contact["contact_sha256"], laws.contact_sha256);
    let index = Index::from_json(&text("index.json")).unwrap();
    for name in index.models.iter().filter(|name| !index.on_demand.contains(name)) {
        let card = Card::from_json(&text(&format!("{name}.json"))).unwrap();
        assert!(laws.sed(&card.onnx_sha256, Way::Given).is_some(), "{name}: calibrate it anew");
        let way = Way::Contact(ContactMethod::Pixels, &laws.contact_sha256);
        // What learnt no pressure of contact states no error from it.
        let is_due = card.learnt().knows_contact();
        assert_eq!(laws.sed(&card.onnx_sha256, way).is_some(), is_due, "{name}: calibrate it anew");
        assert!(laws.force(way).is_some());
    }
}

/// A shipped model, and whether a map takes it long.
struct Tier {
    card: Card,
    session: Box<dyn Session>,
    is_slow: bool,
}

/// All shipped models, one after another, in every backend of this build.
fn each(mut look: impl FnMut(&mut Tier)) {
    for name in Index::from_json(&text("index.json")).unwrap().models {
        for backend in backends() {
            look(&mut Tier::load(&name, backend));
        }
    }
}

impl Tier {
    fn load(name: &str, backend: Backend) -> Self {
        let card = Card::from_json(&text(&format!("{name}.json"))).unwrap();
        let model = load_with(backend, &read(&format!("{name}.onnx")), Some(&card)).unwrap();
        let (session, is_slow) = (model.session().unwrap(), name.starts_with("s1-base16"));
        Self { card, session, is_slow }
    }

    fn max_pa(&self) -> f32 {
        self.card.pressure_range_pa[1]
    }

    fn answer(&mut self, pressure_pa: &[f32]) -> Result<Vec<f32>, EngineError> {
        let mut sed_j_per_m3 = vec![f32::NAN; MAP_LEN];
        self.session.infer(pressure_pa, &mut sed_j_per_m3).map(|()| sed_j_per_m3)
    }

    /// An answer that is due.
    #[track_caller]
    fn map(&mut self, what: &str, pressure_pa: &[f32], interface: &[bool]) -> Vec<f32> {
        let name = self.card.name.clone();
        let sed = self.answer(pressure_pa).unwrap_or_else(|e| panic!("{name}, {what}: {e}"));
        assert!(sed.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}, {what}");
        let off = sed.iter().zip(interface).position(|(v, inside)| !inside && *v > 0.0);
        assert_eq!(off, None, "{name}, {what}: there is SED off the interface");
        sed
    }
}

fn single(pixel: usize, pressure_pa: f32) -> Vec<f32> {
    let mut map = vec![0.0; MAP_LEN];
    map[pixel] = pressure_pa;
    map
}

/// A round contact of `peak_pa` in the middle of the pad, as smooth as real ones.
fn contact(peak_pa: f32) -> Vec<f32> {
    let pressure_pa = |i: usize| {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let r2 = ((row - 80.0) / 34.0).powi(2) + ((column - 112.0) / 30.0).powi(2);
        peak_pa * (1.0 - r2).max(0.0).sqrt()
    };
    (0..MAP_LEN).map(pressure_pa).collect()
}

/// A pixel in the middle, one at the rim and one outside of a mask, and where memory ends.
fn places(mask: &[bool]) -> Vec<usize> {
    let rim = (1..MAP_LEN).find(|&i| mask[i] && !mask[i - 1]).unwrap();
    let middle = 112 * MAP_SIDE_PX + 112;
    assert!(mask[middle] && !mask[0]);
    vec![0, MAP_SIDE_PX - 1, MAP_SIDE_PX, rim - 1, rim, middle, MAP_LEN - MAP_SIDE_PX, MAP_LEN - 1]
}

#[test]
fn maps_that_no_press_makes() {
    let [skin, interface] = masks();
    each(|tier| {
        let max_pa = tier.max_pa();
        let nothing = tier.map("all zero", &vec![0.0; MAP_LEN], &interface);
        assert!(nothing.iter().all(|v| *v <= 0.0), "{}: SED of nothing", tier.card.name);
        let minus = tier.map("minus zero", &vec![-0.0; MAP_LEN], &interface);
        assert!(minus.iter().all(|v| *v <= 0.0), "{}: SED of minus nothing", tier.card.name);
        for (what, pressure_pa) in [
            ("denormals", 1e-40),
            ("1e-30 Pa", 1e-30),
            ("the least normal number", f32::MIN_POSITIVE),
            ("saturated", max_pa),
            ("ten times saturated", 10.0 * max_pa),
        ] {
            tier.map(what, &vec![pressure_pa; MAP_LEN], &interface);
        }
        let is_black = |i: usize| (i / MAP_SIDE_PX + i % MAP_SIDE_PX).is_multiple_of(2);
        let board: Vec<f32> =
            (0..MAP_LEN).map(|i| if is_black(i) { max_pa } else { 0.0 }).collect();
        tier.map("checkerboard", &board, &interface);
        let some = if tier.is_slow { 5..6 } else { 0..8 };
        for pixel in &places(&skin)[some] {
            for pressure_pa in [max_pa, 10.0 * max_pa, 1e-30] {
                tier.map(&format!("pixel {pixel}"), &single(*pixel, pressure_pa), &interface);
            }
        }
    });
}

#[test]
fn what_is_no_pressure_is_named_and_leaves_no_trace() {
    let [skin, interface] = masks();
    each(|tier| {
        let max_pa = tier.max_pa();
        let good = contact(0.5 * max_pa);
        let due = tier.map("a contact", &good, &interface);
        assert!(due.iter().any(|v| *v > 0.0));
        for place in places(&skin) {
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut bad = good.clone();
                bad[place] = value;
                let error = tier.answer(&bad).unwrap_err();
                let at = (place / MAP_SIDE_PX, place % MAP_SIDE_PX);
                assert!(
                    matches!(error, EngineError::NonFiniteInput { row, column, .. } if (row, column) == at),
                    "{}: {error}",
                    tier.card.name
                );
            }
            // Negative pressure is the service's to refuse, before any model is asked.
            let mut bad = good.clone();
            bad[place] = -1.0;
            let range = PressureRange { trained_max_pa: max_pa, beyond: OutOfRange::Flag };
            assert!(matches!(range.check(&bad), Err(MapError::Negative { .. })));
        }
        // Far beyond all that a range lets through: a map that is one, or an error.
        for pressure_pa in [1e20, 1e30, f32::MAX] {
            match tier.answer(&vec![pressure_pa; MAP_LEN]) {
                Ok(sed) => assert!(sed.iter().all(|v| v.is_finite() && *v >= 0.0)),
                Err(error) => assert!(
                    matches!(
                        error,
                        EngineError::NonFiniteOutput { .. } | EngineError::NegativeOutput { .. }
                    ),
                    "{}: {error}",
                    tier.card.name
                ),
            }
        }
        let again = tier.map("the same contact", &good, &interface);
        assert!(again == due, "{}: what was refused left a trace", tier.card.name);
    });
}

/// The card's range is what tells an extrapolation.
#[test]
fn what_the_card_does_not_know_is_flagged() {
    each(|tier| {
        assert!(tier.max_pa() > 1e3 && tier.max_pa() < 1e6, "{}", tier.card.name);
        let flagged = PressureRange { trained_max_pa: tier.max_pa(), beyond: OutOfRange::Flag };
        let strict = PressureRange { beyond: OutOfRange::Refuse, ..flagged };
        for (times, is_left) in [(0.5, false), (1.0, false), (1.02, true), (9.9, true)] {
            let map = contact(times * tier.max_pa());
            let peak_pa = map.iter().copied().fold(0.0, f32::max);
            let summary = flagged.check(&map).unwrap();
            assert_eq!(flagged.is_left_by(summary), peak_pa > 1.01 * tier.max_pa());
            assert_eq!(flagged.is_left_by(summary), is_left, "{} x {times}", tier.card.name);
            assert_eq!(strict.check(&map).is_err(), is_left);
        }
        let far = contact(10.5 * tier.max_pa());
        assert!(matches!(flagged.check(&far), Err(MapError::OutOfRange { .. })));
    });
}

/// The pressure of a flat object on the middle of the pad: Hertz's, of the finger's own radius
/// (docs/reference/atlas.md) on a plane of the atlas' pixels.
fn press(force_n: f32, mm_per_px: f32) -> Vec<f32> {
    let radius_mm = 5.1 * force_n.cbrt();
    let peak_pa = 1.5e6 * force_n / (std::f32::consts::PI * radius_mm * radius_mm);
    let pressure_pa = |i: usize| {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let r_mm = mm_per_px * (row - 100.0).hypot(column - 112.0);
        peak_pa * (1.0 - (r_mm / radius_mm).powi(2)).max(0.0).sqrt()
    };
    (0..MAP_LEN).map(pressure_pa).collect()
}

/// A map through a sample type, each with its own scale, as clients and service do it.
fn quantised(exact: &[f32], sample_type: SampleType) -> Vec<f32> {
    let top = exact.iter().copied().fold(0.0, f32::max);
    let scale = if sample_type.is_scaled() { top / sample_type.unit_max() } else { 1.0 };
    let mut bytes = vec![0; MAP_LEN * sample_type.bytes()];
    sample_type.encode(exact, scale, &mut bytes).unwrap();
    let mut coarse = vec![0.0; MAP_LEN];
    sample_type.decode(&bytes, scale, &mut coarse).unwrap();
    for (p, q) in exact.iter().zip(&coarse) {
        assert!((p - q).abs() <= sample_type.error_max(*p, scale));
    }
    coarse
}

/// What sample types cost in SED, there and back: `docs/concepts/stability.md` states these bounds.
#[test]
fn sample_types_change_sed_within_the_stated_bounds_at_any_force() {
    let [_, interface] = masks();
    let mm_per_px = Atlas::from_json(&text("atlas.json")).unwrap().mm_per_px();
    each(|tier| {
        let size = |map: &[f32]| map.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
        let forces_n: &[f32] =
            if tier.is_slow { &[0.005, 10.0] } else { &[0.005, 0.05, 0.5, 10.0] };
        for &force_n in forces_n {
            let exact = press(force_n, mm_per_px);
            let due = tier.map("f32", &exact, &interface);
            for (sample_type, bound) in
                [(SampleType::F16, 1e-3), (SampleType::U16, 2e-4), (SampleType::U8, 4e-2)]
            {
                let coarse = quantised(&exact, sample_type);
                let found = quantised(&tier.map("quantised", &coarse, &interface), sample_type);
                let off: Vec<f32> = found.iter().zip(&due).map(|(f, d)| f - d).collect();
                let error = size(&off) / size(&due);
                let name = &tier.card.name;
                println!("{name} {sample_type:?} {force_n} N: {error:.2e}");
                assert!(error <= bound, "{name} {sample_type:?} {force_n} N: {error:.2e}");
            }
        }
    });
}

/// The project's bar: 1e-5 of the maximum.
#[cfg(feature = "ort")]
#[test]
fn onnx_runtime_answers_as_tract_does() {
    let [_, interface] = masks();
    let mm_per_px = Atlas::from_json(&text("atlas.json")).unwrap().mm_per_px();
    for name in Index::from_json(&text("index.json")).unwrap().models {
        let mut tiers = backends().into_iter().map(|backend| Tier::load(&name, backend));
        let [mut tract, mut ort] = [tiers.next().unwrap(), tiers.next().unwrap()];
        for force_n in [0.05, 1.0, 10.0] {
            let pressure_pa = press(force_n, mm_per_px);
            let due = tract.map("tract", &pressure_pa, &interface);
            let found = ort.map("ONNX Runtime", &pressure_pa, &interface);
            let greatest = due.iter().copied().fold(0.0, f32::max);
            let apart = due.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            println!("{name} {force_n} N: {:.2e}", apart / greatest);
            assert!(apart <= 1e-5 * greatest, "{name} {force_n} N: {:.2e}", apart / greatest);
        }
    }
}
