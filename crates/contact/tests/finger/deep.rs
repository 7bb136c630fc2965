//! Bodies on straight ways through the finger.

use crate::support::{Finger, Throw, atlas};
use papilla_atlas::{Patch, Raster};
use papilla_contact::{
    Contact, ContactError, Gaps, Method, NetForce, Object, PixelContact, PixelSkin, PixelSpacing,
    Settings, Solver, WORK_MAX,
};
use papilla_sdf::{RoundedPlate, SignedDistance, Sphere};
use std::sync::Arc;

/// A knife 30 mm long that leaves the finger at its ends first.
const WEDGE: usize = 4;

type Shape = (Arc<dyn SignedDistance>, f64);

/// How a way is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    AtVertices(Method),
    OnPixels(PixelSpacing),
}

const WAYS: [Way; 5] = [
    Way::AtVertices(Method::Springs),
    Way::AtVertices(Method::SmallStrain),
    Way::AtVertices(Method::SecondOrder),
    Way::OnPixels(PixelSpacing::Two),
    Way::OnPixels(PixelSpacing::One),
];

/// A finger that remembers, solved in one way.
pub(crate) struct Pressed {
    solver: Solver,
    pixels: Option<PixelContact>,
    pub(crate) out: Contact,
}

impl Pressed {
    pub(crate) fn new(finger: &Finger, skin: &Arc<PixelSkin>, way: Way) -> Self {
        let method = match way {
            Way::AtVertices(method) => method,
            Way::OnPixels(_) => Method::SecondOrder,
        };
        let settings = Settings { method, ..Settings::default() };
        let pixels = match way {
            Way::AtVertices(_) => None,
            Way::OnPixels(spacing) => {
                Some(PixelContact::new(Arc::clone(skin), &finger.model, spacing))
            }
        };
        Self {
            solver: Solver::new(finger.model.clone(), settings).expect("a solver"),
            pixels,
            out: Contact::new(finger.model.vertices()),
        }
    }

    /// Presses; what runs away is not settled, and the next frame starts anew.
    pub(crate) fn press(&mut self, objects: &[Object]) {
        let found = match &mut self.pixels {
            Some(pixels) => self.solver.solve_on_pixels(objects, pixels, &mut self.out),
            None => self.solver.solve(objects, &mut self.out),
        };
        match found {
            Err(ContactError::Diverged) => self.out.quality.settled = false,
            found => found.expect("an answer"),
        }
    }

    pub(crate) fn is_told(&self) -> bool {
        !self.out.quality.settled || self.out.quality.out_of_range
    }
}

pub(crate) fn skin(finger: &Finger) -> Arc<PixelSkin> {
    let atlas = atlas();
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    Arc::new(PixelSkin::new(&finger.model, &atlas, raster).expect("layers"))
}

/// Ten shapes, each with how far it really goes up.
fn shapes() -> Vec<Shape> {
    let up = |(shape, _): Shape| (shape.clone(), shape.reach_mm([0.0, 0.0, 1.0]));
    crate::support::shapes().into_iter().map(up).collect()
}

fn thin() -> [Shape; 3] {
    [
        (Arc::new(Sphere { radius_mm: 1.0 }), 1.0),
        (Arc::new(RoundedPlate { half_mm: [10.0, 10.0, 0.15], edge_radius_mm: 0.1 }), 0.15),
        (Arc::new(RoundedPlate { half_mm: [0.15, 10.0, 6.0], edge_radius_mm: 0.1 }), 6.0),
    ]
}

/// Force along the way in, N.
fn inward(object: &Object, out: &Contact) -> f64 {
    (0..3).map(|i| object.placement.rotation[i][2] * out.force_n[i]).sum()
}

/// Ten shapes and three thin ones, random straight ways to 15 mm, small and large steps, every method:
/// force along the way neither pulls nor falls unless the answer says so, and nothing that lies in
/// the finger goes unnoticed.
#[test]
fn a_body_on_a_straight_way_never_pulls_and_never_fades_silently() {
    let finger = Finger::new();
    let (skin, shapes) = (skin(&finger), [&shapes()[..], &thin()[..]].concat());
    let trusted_mm = f64::from(finger.model.header().depth_max_mm);
    let mut random = fastrand::Rng::with_seed(53);
    let inner: Vec<usize> = finger.inner();
    let (mut shallow, mut shallow_told) = (0, 0);
    for (shape, step_mm) in (0..shapes.len()).flat_map(|s| [0.05, 0.4, 3.0].map(|step| (s, step))) {
        for way in WAYS {
            // Pixels take ten times as long.
            let is_long = match way {
                Way::AtVertices(_) => false,
                Way::OnPixels(PixelSpacing::Two) => step_mm < 0.1,
                Way::OnPixels(PixelSpacing::One) => step_mm < 0.1 || shape % 3 != 1,
            };
            if is_long {
                continue;
            }
            let mut throw = Throw {
                vertex: inner[random.usize(..inner.len())],
                depth_mm: -0.3,
                tilt_deg: [0, 1].map(|_| 20.0 * random.f64() - 10.0),
                spin_deg: 360.0 * random.f64(),
            };
            let mut pressed = Pressed::new(&finger, &skin, way);
            let (mut most_n, mut deepest) = (0.0f64, 0);
            while throw.depth_mm < if step_mm < 0.1 { 4.0 } else { 15.0 } {
                let object = finger.place(&shapes[shape], throw);
                // Beyond the finger, which is open above, it is let go.
                if finger.is_below(&object) || (shape == WEDGE && !finger.is_about(&object)) {
                    break;
                }
                pressed.press(std::slice::from_ref(&object));
                let force_n = inward(&object, &pressed.out);
                let told = format!(
                    "shape {shape}, {way:?}, steps of {step_mm}: {force_n:.4} N after {most_n:.4}, \
                     {throw:?}, {:?}",
                    pressed.out.quality
                );
                assert!(pressed.out.force_n.iter().all(|f| f.is_finite()), "{told}");
                // Force gives way by some mN where an edge passes from vertex to vertex, or from
                // pixel to pixel.
                let slack_n = 1e-2 + 0.05 * most_n;
                let is_told = pressed.is_told();
                assert!(is_told || force_n >= -1e-3, "pulls: {told}");
                assert!(is_told || force_n >= most_n - slack_n, "falls: {told}");
                // The skin of this finger ends 4.5 mm above its lowest point.
                if finger.holds(&object) {
                    let is_met = !pressed.out.touched().is_empty();
                    assert!(is_met || pressed.out.quality.is_held, "missed: {told}");
                    deepest += usize::from(throw.depth_mm > trusted_mm && is_told);
                }
                if (0.1..trusted_mm).contains(&throw.depth_mm) && matches!(shape, 0..=2) {
                    shallow += 1;
                    shallow_told += usize::from(is_told);
                }
                if !is_told {
                    most_n = most_n.max(force_n);
                }
                throw.depth_mm += step_mm;
            }
            assert!(
                deepest > 0 || step_mm > 1.0 || shape == WEDGE,
                "shape {shape}, {way:?}: never deep"
            );
        }
    }
    println!("{shallow_told} of {shallow} ordinary presses are flagged");
    assert!(10 * shallow_told < shallow, "{shallow_told} of {shallow}");
}

/// A thin body presses as a thick one whose face is the same.
#[test]
fn a_card_presses_as_a_plate_does() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let [.., (card, top), _] = thin();
    let plate: Shape =
        (Arc::new(RoundedPlate { half_mm: [10.0, 10.0, 3.0], edge_radius_mm: 0.1 }), 3.0);
    let vertex = finger.lowest();
    for way in WAYS {
        let [mut thin, mut thick] = [0, 1].map(|_| Pressed::new(&finger, &skin, way));
        for step in 1..9 {
            let depth_mm = 0.1 * f64::from(step);
            let throw = Throw { vertex, depth_mm, tilt_deg: [3.0, 2.0], spin_deg: 10.0 };
            thin.press(&[finger.place(&(card.clone(), top), throw)]);
            thick.press(&[finger.place(&plate, throw)]);
            let [a, b] = [&thin, &thick].map(|p| p.out.force_n[2]);
            assert!((a / b - 1.0).abs() < 0.06, "{way:?}, {depth_mm} mm: {a} N, {b} N");
            assert!(!thin.is_told() || thick.is_told(), "{way:?}, {depth_mm} mm");
        }
    }
}

/// At vertices a narrow body that does not move is not held and let go by turns.
#[test]
fn a_narrow_body_at_rest_presses_alike_in_each_frame() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let mut random = fastrand::Rng::with_seed(72);
    let inner = finger.inner();
    let mut held = 0;
    for case in 0..60 {
        let half_mm = [0.1 + 0.4 * random.f64(), 0.2 + 3.0 * random.f64(), 3.0];
        let blade: Shape = (Arc::new(RoundedPlate { half_mm, edge_radius_mm: 0.05 }), 3.0);
        let throw = Throw {
            vertex: inner[random.usize(..inner.len())],
            depth_mm: 0.2 + 0.6 * random.f64(),
            tilt_deg: [0, 1].map(|_| 20.0 * random.f64() - 10.0),
            spin_deg: 360.0 * random.f64(),
        };
        let object = [finger.place(&blade, throw)];
        for way in WAYS.into_iter().filter(|way| matches!(way, Way::AtVertices(_))) {
            let mut pressed = Pressed::new(&finger, &skin, way);
            let mut frame = || {
                pressed.press(&object);
                let quality = pressed.out.quality;
                (quality.is_held, pressed.is_told(), inward(&object[0], &pressed.out))
            };
            frame();
            let [first, next @ ..] = [0; 6].map(|_| frame());
            let told = format!("{case}, {way:?}: {first:?} {next:?}");
            held += usize::from(first.0);
            for (is_held, is_told, force_n) in next {
                assert_eq!(is_held, first.0, "{told}");
                let by_n = (force_n - first.2).abs();
                assert!(is_told || first.1 || by_n < 0.03 * force_n + 2e-4, "{told}");
            }
        }
    }
    assert!(held > 60, "{held} are held");
}

/// What was never seen on its way gets the shortest way out, and the answer says so.
#[test]
fn a_first_frame_deep_inside_is_answered_and_flagged() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let vertex = finger.lowest();
    let trusted_mm = f64::from(finger.model.header().depth_max_mm);
    for (shape, top) in [&shapes()[..], &thin()[..]].concat() {
        for way in WAYS {
            // A ring is met by skin beside its middle, which lies higher.
            for depth_mm in [2.5, 2.9].map(|d| d * trusted_mm) {
                let throw = Throw { vertex, depth_mm, tilt_deg: [0.0; 2], spin_deg: 0.0 };
                let object = finger.place(&(shape.clone(), top), throw);
                let mut pressed = Pressed::new(&finger, &skin, way);
                pressed.press(&[object]);
                let told = format!("{way:?}, {top} high, {depth_mm}: {:?}", pressed.out.quality);
                assert!(pressed.is_told(), "silent: {told}");
                let is_met = !pressed.out.touched().is_empty();
                assert!(is_met || pressed.out.quality.is_held, "missed: {told}");
                assert!(pressed.out.force_n[2] >= -1e-3, "pulls: {told}");
            }
        }
    }
}

/// Held, carried to another solver, let go and back: the same bits as one that stayed, and as new
/// after a reset.
#[test]
fn the_side_is_part_of_the_memory() {
    let finger = Finger::new();
    let vertex = finger.lowest();
    let ball: Shape = (Arc::new(Sphere { radius_mm: 1.0 }), 1.0);
    let at = |depth_mm: f64| {
        let throw = Throw { vertex, depth_mm, tilt_deg: [4.0, 0.0], spin_deg: 0.0 };
        [finger.place(&ball, throw)]
    };
    let solver = || Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
    let (mut stays, mut out) = (solver(), Contact::new(finger.model.vertices()));
    for step in 0..12 {
        stays.solve(&at(0.3 * f64::from(step)), &mut out).expect("an answer");
    }
    assert!(out.quality.is_held && out.force_n[2] > 0.0, "{:?}", out.quality);
    let mut moved = solver();
    assert!(moved.recall(&stays.memory()));
    let mut of_moved = Contact::new(finger.model.vertices());
    for depth_mm in [3.5, 3.2, 1.0, 0.2, -1.0, 0.3] {
        stays.solve(&at(depth_mm), &mut out).expect("an answer");
        moved.solve(&at(depth_mm), &mut of_moved).expect("an answer");
        assert_eq!(of_moved, out, "{depth_mm} mm");
        assert!(depth_mm > 0.2 || !out.quality.is_held, "{depth_mm} mm: it is still held");
    }
    stays.reset();
    let mut fresh = solver();
    stays.solve(&at(0.4), &mut out).expect("an answer");
    fresh.solve(&at(0.4), &mut of_moved).expect("an answer");
    assert_eq!(of_moved, out, "a reset keeps a side");
}

/// Gaps that grow go on pressing harder, and say that they are deeper than the model knows.
#[test]
fn deep_gaps_press_on_and_are_flagged() {
    let finger = Finger::new();
    let trusted_mm = finger.model.header().depth_max_mm;
    let low = finger.places_mm[finger.lowest()][2];
    let mut solver = Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
    let mut out = Contact::new(finger.model.vertices());
    let mut last = 0.0;
    for step in 0..40 {
        let deep = 0.1 * f64::from(step);
        let depth_mm: Vec<f32> =
            finger.places_mm.iter().map(|p| (deep - (p[2] - low)) as f32).collect();
        solver.solve(Gaps::rigid(&depth_mm), &mut out).expect("an answer");
        assert!(out.force_n[2] >= last, "{deep} mm: {} N after {last}", out.force_n[2]);
        let is_deep = depth_mm.iter().any(|d| *d > trusted_mm);
        assert!(!is_deep || out.quality.out_of_range, "{deep} mm: silent");
        last = out.force_n[2];
    }
}

/// A force beyond that of the trusted depth is met by what goes on from it, and flagged.
#[test]
fn a_great_net_force_is_met_and_flagged() {
    let finger = Finger::new();
    let ball: Shape = (Arc::new(Sphere { radius_mm: 3.0 }), 3.0);
    let throw =
        Throw { vertex: finger.lowest(), depth_mm: -0.4, tilt_deg: [0.0; 2], spin_deg: 0.0 };
    let object = [finger.place(&ball, throw)];
    let mut solver = Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
    let mut out = Contact::new(finger.model.vertices());
    let mut last = 0.0;
    for force_n in [0.02, 0.1, 0.4, 1.0, 1.5] {
        let net = NetForce { direction: [0.0, 0.0, 1.0], force_n };
        let travel = solver.solve_for_force(&object, net, &mut out).expect("a travel");
        assert!((out.force_n[2] / force_n - 1.0).abs() < 3e-3, "{} N", out.force_n[2]);
        assert!(travel > last, "{travel} mm after {last}");
        last = travel;
    }
    assert!(out.quality.out_of_range);
}

/// A force that no depth gives is refused after a few frames, wherever things start; one that is
/// met by drawing back from deep inside is found in about as many.
#[test]
fn an_unreachable_net_force_is_seen_at_once() {
    const FRAMES: u32 = 12;
    let finger = Finger::new();
    let skin = skin(&finger);
    let ball: Shape = (Arc::new(Sphere { radius_mm: 8.0 }), 8.0);
    let at = |depth_mm: f64| {
        let throw = Throw { vertex: finger.lowest(), depth_mm, tilt_deg: [0.0; 2], spin_deg: 0.0 };
        [finger.place(&ball, throw)]
    };
    for depth_mm in [-0.5, 0.5, 3.0, 9.0] {
        for (force_n, is_met) in [(1e30, false), (0.1, true)] {
            let mut pressed = Pressed::new(&finger, &skin, Way::AtVertices(Method::SecondOrder));
            let net = NetForce { direction: [0.0, 0.0, 1.0], force_n };
            let out = &mut pressed.out;
            let found = pressed.solver.solve_for_force(&at(depth_mm), net, out);
            let told = format!("{force_n} N from {depth_mm} mm: {found:?}, {:?}", out.effort);
            assert_eq!(found.is_ok(), is_met, "{told}");
            if !is_met {
                assert!(matches!(found, Err(ContactError::Force { .. })), "{told}");
            }
            // A frame takes 73 linearisations at most.
            assert!(out.effort.iterations <= 25 * FRAMES, "{told}");
        }
    }
}

/// Rough things all round, far in and moving: a frame goes over no more than its budget and one
/// linearisation, the same each time.
#[test]
fn a_frame_keeps_its_budget_of_work() {
    let finger = Finger::new();
    let mut random = fastrand::Rng::with_seed(54);
    let count = finger.places_mm.len();
    let depth_mm: Vec<f32> = (0..count).map(|_| 0.6 + 0.35 * random.f32()).collect();
    let moved_mm: Vec<[f32; 3]> = (0..count).map(|_| [0; 3].map(|_| random.f32() - 0.5)).collect();
    let settings = Settings { friction: true, ..Settings::default() };
    let of_two = [0, 1].map(|_| {
        let mut solver = Solver::new(finger.model.clone(), settings).expect("a solver");
        let mut out = Contact::new(count);
        for _ in 0..2 {
            let gaps = Gaps { friction: 8.0, moved_mm: &moved_mm, ..Gaps::rigid(&depth_mm) };
            solver.solve(gaps, &mut out).expect("an answer");
            // A linearisation has 200 products along normals and 60 along tangents at most.
            let one = (200 + 4 * 60) * (count as u64).pow(2);
            assert!(out.effort.work <= WORK_MAX + one, "{:?}", out.effort);
            assert!(out.effort.work < WORK_MAX || !out.quality.settled, "{:?}", out.quality);
        }
        // On the real finger these gaps may be easier.
        let is_made = std::env::var("PAPILLA_CONTACT_MODEL").is_err();
        assert!(!is_made || out.effort.work >= WORK_MAX, "never at its budget: {:?}", out.effort);
        out
    });
    let [a, b] = &of_two;
    assert_eq!(a, b);
}
