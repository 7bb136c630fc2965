//! Campaign files and what is drawn from them.

use super::testing::{several, spec};
use super::*;
use crate::mesh::fingertip::Density;
use crate::scene::Pose;
use crate::simulation::drive::Drive;
use papilla_sdf::{IndenterSpec, Plate};
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn poses_fill_their_ranges_and_follow_the_seed() {
    let wide = CampaignSpec { presses: 64, ..spec() };
    let poses =
        |spec: &CampaignSpec| -> Vec<Pose> { indentations(spec).iter().map(|p| p.pose).collect() };
    let points = poses(&wide);
    assert_eq!(points[..7], poses(&spec())[..], "the first poses do not depend on the number");
    let cell = |p: &Pose| {
        let index = |x: f64, low: f64, width: f64| ((x - low) / width * 8.0) as usize;
        index(p.pitch_deg, 0.0, 45.0) * 8 + index(p.roll_deg, -30.0, 60.0)
    };
    // 64 Sobol points in 2-D: at most two of 8 x 8 cells' neighbours stay
    // empty; of random points some 23 cells would.
    let mut cells: Vec<usize> = points.iter().map(cell).collect();
    cells.sort_unstable();
    cells.dedup();
    assert!(cells.len() >= 60, "{} of 64 cells hit", cells.len());
    assert!(points.iter().all(|p| (0.0..45.0).contains(&p.pitch_deg) && p.yaw_deg.abs() < 1e-12));
    let other = poses(&CampaignSpec { seed: 4, ..wide });
    assert!(points.iter().zip(&other).filter(|(a, b)| a == b).count() < 3);
}

/// The Sobol sequence has 65 536 points; what comes after them fills the ranges as evenly, with other
/// poses.
#[test]
fn a_million_indentations_fill_their_ranges() {
    let million = CampaignSpec { presses: 1_000_000, ..spec() };
    million.validate().unwrap();
    assert_eq!(million.samples(), 1_000_000 * spec().depths_mm.len());
    assert_eq!(indentations_in(&million, 0..7), indentations(&spec()));
    let last = indentations_in(&million, 999_990..1_000_000);
    assert_eq!((last.len(), last[9].id), (10, 999_999));
    let poses = |round: usize| -> Vec<[f64; 2]> {
        let ids = round * 65_536..(round + 1) * 65_536;
        let own = indentations_in(&million, ids);
        own.iter().map(|p| [p.pose.pitch_deg / 45.0, (p.pose.roll_deg + 30.0) / 60.0]).collect()
    };
    let rounds = [0, 1, 14].map(poses);
    for round in &rounds {
        // A net: each of 32 x 32 cells has its 64 points.
        let mut had = vec![0; 32 * 32];
        for [x, y] in round {
            had[(x * 32.0) as usize * 32 + (y * 32.0) as usize] += 1;
        }
        assert!(had.iter().all(|&n| n == 64), "{had:?}");
    }
    let all: BTreeSet<[u64; 2]> =
        rounds.iter().flatten().map(|pose| pose.map(f64::to_bits)).collect();
    assert!(all.len() > 3 * 65_536 - 10, "{} poses", all.len());
}

#[test]
fn indenters_take_turns_by_their_shares() {
    let all = indentations(&several());
    let count = |name: &str, n: usize| all[..n].iter().filter(|p| p.indenter == name).count();
    for n in 1..=64 {
        for (name, share) in [("plate", 0.25), ("ball", 0.5), ("small plate", 0.25)] {
            let lag = share * n as f64 - count(name, n) as f64;
            assert!(lag.abs() < 1.0, "{name}: {lag} behind after {n}");
        }
    }
    assert_eq!(all[..9], indentations(&CampaignSpec { presses: 9, ..several() })[..]);
    assert_ne!(all, indentations(&CampaignSpec { seed: 4, ..several() }));
}

#[test]
fn an_indenter_has_its_own_ranges() {
    let all = indentations(&several());
    for ball in all.iter().filter(|p| p.indenter == "ball") {
        assert_eq!((ball.shape.as_str(), ball.depths_mm.len()), ("sphere", 3));
        assert!((10.0..20.0).contains(&ball.pose.pitch_deg));
        assert!((-2.0..2.0).contains(&ball.offset_mm[0]));
        let deepest = ball.depths_mm[2];
        assert!((1.0..1.5).contains(&deepest) && (ball.depths_mm[0] - deepest / 3.0).abs() < 1e-15);
    }
    let plates: Vec<_> = all.iter().filter(|p| p.shape == "plate").collect();
    assert!(plates.iter().all(|p| p.depths_mm == [0.25, 0.5] && p.offset_mm == [0.0, 0.0]));
    // Each indenter has a sequence of its own: no two share a pose.
    let first = |name: &str| plates.iter().find(|p| p.indenter == name).unwrap().pose;
    assert_ne!(first("plate"), first("small plate"));
}

fn slide(length_mm: [f64; 2], direction_deg: [f64; 2], states: usize) -> Option<SlideRange> {
    Some(SlideRange { length_mm, direction_deg, states })
}

#[test]
fn an_indentation_slides_at_its_deepest() {
    let sliding = CampaignSpec { slide: slide([0.5, 1.5], [-180.0, 180.0], 2), ..spec() };
    sliding.validate().unwrap();
    assert_eq!(sliding.samples(), 7 * 4);
    let all = indentations(&sliding);
    for press in &all {
        let states: Vec<_> = press.states().collect();
        assert_eq!(states[..2], [(0.25, [0.0; 2]), (0.5, [0.0; 2])]);
        let [half, whole] = [states[2], states[3]];
        assert!(states[2..].iter().all(|(depth_mm, _)| depth_mm.total_cmp(&0.5).is_eq()));
        let length = |[x, y]: [f64; 2]| x.hypot(y);
        assert!((0.5..1.5).contains(&length(whole.1)));
        assert!((length(half.1) / length(whole.1) - 0.5).abs() < 1e-12);
        let Drive::Path(points) = press.drive() else { panic!("a way that turns") };
        assert_eq!((points.len(), points[3].shift_mm), (4, whole.1));
        assert_eq!(press.motion().path.unwrap().len(), 4);
    }
    // Their ways in are those of the campaign that does not slide.
    for (press, straight) in all.into_iter().zip(indentations(&spec())) {
        assert_eq!(Indentation { slide_mm: Vec::new(), ..press }, straight);
        assert!(matches!(straight.drive(), Drive::Depths(_)) && straight.motion().path.is_none());
    }
}

#[test]
fn the_split_is_by_press_and_follows_the_seed() {
    let spec = CampaignSpec { presses: 125, test_fraction: Some(0.2), ..spec() };
    let split = held_out(&spec);
    assert_eq!((split.train.len(), split.test.len()), (100, 25));
    let mut all = [split.train.clone(), split.test.clone()].concat();
    all.sort_unstable();
    assert_eq!(all, (0..125).collect::<Vec<_>>());
    assert_eq!(split, held_out(&spec));
    assert_ne!(split.test, held_out(&CampaignSpec { seed: 9, ..spec.clone() }).test);
    let two = held_out(&CampaignSpec { presses: 2, test_fraction: Some(0.2), ..spec });
    assert_eq!((two.train.len(), two.test.len()), (1, 1));
}

#[test]
fn one_of_each_five_is_held_out_and_stays_so_when_more_follow() {
    let of = |presses| {
        held_out(&CampaignSpec { presses, test_fraction: None, test_one_in: Some(5), ..spec() })
    };
    let most = of(100);
    for presses in [4, 5, 9, 10, 25, 50, 100] {
        let split = of(presses);
        assert_eq!(split.test.len(), presses / 5);
        let mut all = [split.train.clone(), split.test.clone()].concat();
        all.sort_unstable();
        assert_eq!(all, (0..presses).collect::<Vec<_>>());
        let whole = presses / 5 * 5;
        let first = |ids: &[usize]| ids.iter().copied().filter(|id| *id < whole).collect();
        let nested: [Vec<usize>; 2] = [first(&most.train), first(&most.test)];
        assert_eq!([first(&split.train), split.test], nested);
    }
    for block in 0..20 {
        let own = 5 * block..5 * block + 5;
        assert_eq!(most.test.iter().filter(|id| own.contains(*id)).count(), 1);
    }
    // Not always the same place of the five: that would be the same indenters.
    assert!((0..5).all(|place| most.test.iter().any(|id| id % 5 == place)));
}

#[test]
fn shipped_campaigns_are_readable() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns");
    let s1 = CampaignSpec::read(&folder.join("s1-graded.toml")).unwrap();
    assert_eq!((s1.samples(), s1.test_fraction.map(f64::to_bits)), (1000, Some(0.2f64.to_bits())));
    assert_eq!(CampaignSpec::read(&folder.join("smoke.toml")).unwrap().density, Density::Coarse);
    let broad = CampaignSpec::read(&folder.join("broad-graded.toml")).unwrap();
    let held = CampaignSpec::read(&folder.join("heldout-graded.toml")).unwrap();
    let shapes = |spec: &CampaignSpec| -> BTreeSet<String> {
        indentations(spec).into_iter().map(|p| p.shape).collect()
    };
    for shape in ["plate", "sphere", "cylinder", "punch", "grating"] {
        assert!(shapes(&broad).contains(shape), "{shape}");
    }
    for shape in ["wedge", "ring", "dots"] {
        assert!(shapes(&held).contains(shape), "{shape}");
    }
    // Both have dots: Braille of its own size in the one, and in the other twice as large.
    let indenters = |spec: &CampaignSpec| -> BTreeSet<String> {
        spec.candidates().into_iter().map(|c| format!("{:?}", c.indenter)).collect()
    };
    assert!(indenters(&broad).is_disjoint(&indenters(&held)), "no held-out indenter is seen");
}

fn several_with(change: fn(&mut Candidate)) -> CampaignSpec {
    let mut spec = several();
    change(&mut spec.indenters[1]);
    spec
}

fn bad_depths() -> Option<DepthRange> {
    Some(DepthRange { deepest_mm: [0.0, 1.0], states: 2 })
}

#[test]
fn senseless_campaigns_are_refused_by_field() {
    type Spoil = fn(&mut CampaignSpec);
    let cases: [(Spoil, &str); 22] = [
        (|s| s.effects.push("viscoelastic".to_string().try_into().unwrap()), "viscoelastic"),
        (|s| s.effects.push("friction".to_string().try_into().unwrap()), "friction.coefficient"),
        (|s| s.indenter = None, "indenter"),
        (|s| s.depths = Some(DepthRange { deepest_mm: [1.0, 2.0], states: 2 }), "depths"),
        (|s| s.offset_mm[1] = [2.0, -2.0], "offset_mm"),
        (
            |s| *s = CampaignSpec { indenter: Some(IndenterSpec::default()), ..several() },
            "indenters",
        ),
        (|s| *s = several_with(|c| c.share = 0), "indenters[1].share"),
        (|s| *s = several_with(|c| c.name = "plate".into()), "indenters[1].name"),
        (|s| *s = several_with(|c| c.depths = bad_depths()), "indenters[1].depths.deepest_mm"),
        (|s| s.presses = 0, "presses"),
        (|s| s.presses = (1 << 20) + 1, "presses"),
        (|s| s.depths_mm = vec![1.0, 0.5], "depths_mm"),
        (|s| s.depths_mm = vec![f64::NAN], "depths_mm"),
        (|s| s.test_fraction = Some(1.0), "test_fraction"),
        (|s| s.test_fraction = None, "test_fraction"),
        (|s| s.test_one_in = Some(5), "test_fraction"),
        (|s| (s.test_fraction, s.test_one_in) = (None, Some(1)), "test_one_in"),
        (
            |s| {
                let plate = Plate { edge_radius_mm: 11.0, ..Plate::default() };
                s.indenter = Some(IndenterSpec::Plate(plate));
            },
            "indenter.edge_radius_mm",
        ),
        (|s| s.pose.roll_deg = [10.0, -10.0], "roll_deg"),
        (|s| s.slide = slide([0.0, 1.0], [0.0, 0.0], 1), "slide.length_mm"),
        (|s| s.slide = slide([0.5, 1.0], [0.0, 400.0], 1), "slide.direction_deg"),
        (|s| s.slide = slide([0.5, 1.0], [0.0, 90.0], 0), "slide.states"),
    ];
    for (spoil, field) in cases {
        let mut bad = spec();
        spoil(&mut bad);
        let text = bad.validate().unwrap_err().to_string();
        assert!(text.contains(field), "{text}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.toml");
    std::fs::write(&path, "name = \"x\"\nspeed = 3\n").unwrap();
    let text = CampaignSpec::read(&path).unwrap_err().to_string();
    assert!(text.contains("odd.toml") && text.contains("speed"), "{text}");
    // As editors on Windows write it.
    let smoke = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/smoke.toml");
    let smoke = std::fs::read_to_string(smoke).unwrap();
    std::fs::write(&path, format!("\u{feff}{smoke}")).unwrap();
    CampaignSpec::read(&path).unwrap();
    let wide: Vec<u8> = smoke.encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(&path, wide).unwrap();
    let text = CampaignSpec::read(&path).unwrap_err().to_string();
    assert!(text.contains("odd.toml") && text.contains("UTF-16"), "{text}");
}
