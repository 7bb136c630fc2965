//! The measurement on the coarse mesh.

use super::*;
use ndarray::Ix2;
use papilla_fingertip::campaign::{Candidate, PoseRanges};
use papilla_fingertip::scene::effects::usual;
use papilla_fingertip::scene::{Friction, TissueTable};
use papilla_output::npz::NpzArrays;
use papilla_sdf::{IndenterSpec, Sphere};

const COARSE: FidelityLevel = FidelityLevel::new(Density::Coarse, Order::Linear, Strain::Finite);

fn spec() -> CampaignSpec {
    let candidate = |name: &str, indenter| Candidate {
        name: name.into(),
        share: 1,
        indenter,
        pose: None,
        offset_mm: None,
        depths: None,
    };
    CampaignSpec {
        name: "test".into(),
        seed: 5,
        presses: 8,
        depths_mm: vec![0.1, 0.3],
        depths: None,
        test_fraction: 0.5,
        density: Density::Medium,
        order: Order::default(),
        effects: usual(),
        materials: TissueTable::default(),
        friction: Friction::default(),
        indenter: None,
        indenters: vec![
            candidate("plate", IndenterSpec::default()),
            candidate("ball", IndenterSpec::Sphere(Sphere { radius_mm: 6.0 })),
        ],
        pose: PoseRanges { pitch_deg: [0.0, 20.0], roll_deg: [-5.0, 5.0], yaw_deg: [0.0, 0.0] },
        offset_mm: [[0.0; 2]; 2],
        folder: Default::default(),
    }
}

fn ladder() -> Ladder {
    let quadratic = FidelityLevel::new(Density::Coarse, Order::Quadratic, Strain::Finite);
    Ladder {
        atlas: Density::Coarse,
        levels: vec![FidelityLevel::new(Density::Coarse, Order::Linear, Strain::Small), quadratic],
        reference: COARSE,
        check: Some(quadratic),
        checked: 1,
    }
}

#[test]
fn rungs_are_solved_once_and_compared_with_the_reference() {
    let folder = tempfile::tempdir().unwrap();
    let slice = |index, count| {
        let part = (2, Slice::new(index, count).unwrap());
        super::run(&spec(), &ladder(), part, folder.path(), &mut |_, _, _| ()).unwrap()
    };
    let run = || slice(1, 1).unwrap();
    // What a slice has solved is not solved again, and a slice makes no report.
    assert!(slice(2, 3).is_none());
    let parts = || std::fs::read_dir(folder.path().join("parts")).unwrap().map(|e| e.unwrap());
    let solved: Vec<_> = parts().map(|e| (e.path(), e.metadata().unwrap().modified())).collect();
    let report = run();
    assert!(solved.len() > 1 && solved.len() < parts().count());
    for (path, then) in solved {
        assert_eq!(path.metadata().unwrap().modified().unwrap(), then.unwrap(), "{path:?}");
    }
    assert_eq!(report.states.len(), 4);
    assert!(report.left_out.is_empty(), "{:?}", report.left_out);
    let shapes: Vec<_> = report.states.iter().map(|s| s.shape.as_str()).collect();
    assert!(shapes.contains(&"plate") && shapes.contains(&"sphere"), "{shapes:?}");
    let [small, quadratic, reference] = &report.levels[..] else { panic!("{:?}", report.levels) };
    assert!(reference.reference && !quadratic.reference);
    assert!(reference.sed_relative_l2.p95 == 0.0);
    let own = reference.discretisation_error.as_ref().unwrap();
    println!("small strain {:?}, own {own:?}", small.sed_relative_l2);
    assert!(own.states == 2 && own.sed_relative_l2 > 0.01 && own.presses.len() == 1);
    // At such depths strain is small; these few nodes in contact are no resolved contact, so
    // of the quadratic fidelity level only force is asked.
    assert!(small.sed_relative_l2.median > 1e-4 && small.sed_relative_l2.p95 < 0.3);
    assert!(quadratic.sed_relative_l2.median.is_finite());
    for level in &report.levels {
        assert!(level.seconds.chunks(2).all(|s| 0.0 < s[0] && s[0] < s[1]), "path included");
        let path = folder.path().join(&level.file);
        let bytes = std::fs::read(&path).unwrap();
        let mut npz = NpzArrays::new(&path, &bytes).unwrap();
        let sed = npz.get::<f32, Ix2>("sed_dermis_j_per_m3").unwrap();
        let force = npz.get::<f32, Ix2>("force_n").unwrap();
        assert_eq!((sed.nrows(), force.dim()), (4, (4, 3)));
        assert!(sed.iter().all(|s| s.is_finite() && *s >= 0.0));
        assert!(force.rows().into_iter().all(|f| f[2] > 0.0), "the pad is pushed up");
        assert_eq!(npz.get::<f32, Ix2>("pressure_pa").unwrap().dim(), sed.dim());
    }
    // Again: nothing is solved, so the times are those of the first run; and a part
    // that was lost is solved again, to the same fields.
    assert_eq!(run(), report);
    let part = std::fs::read_dir(folder.path().join("parts")).unwrap().map(|e| e.unwrap().path());
    let lost = part.into_iter().find(|p| p.to_string_lossy().contains("linear-small")).unwrap();
    std::fs::remove_file(&lost).unwrap();
    let again = run();
    assert_eq!(again.states, report.states);
    assert_eq!(again.levels[0].sed_relative_l2, report.levels[0].sed_relative_l2);
    // The folder is this campaign's.
    let other = CampaignSpec { seed: 6, ..spec() };
    let error = super::run(&other, &ladder(), (1, Slice::WHOLE), folder.path(), &mut |_, _, _| ())
        .unwrap_err();
    assert!(matches!(error, FidelityError::Occupied { .. }), "{error}");
}

#[test]
fn presses_that_are_not_held_out_are_not_taken() {
    let test = held_out(&spec()).test;
    let chosen = choose(&spec(), 4).unwrap();
    assert!(chosen.iter().all(|p| test.contains(&p.id)));
    assert_ne!(chosen[0].candidate, chosen[1].candidate, "indenters take turns");
    let error = choose(&spec(), 5).unwrap_err();
    assert!(matches!(error, FidelityError::TooFew { found: 4, wanted: 5, .. }), "{error}");
    assert!(choose(&spec(), 0).is_err());
}

#[test]
fn names_say_density_order_and_strain() {
    assert_eq!(COARSE.name(), "fe-coarse-linear-finite");
    let usual = Ladder::usual(1);
    assert_eq!((usual.levels.len(), usual.all(3).len()), (8, 10));
    assert_eq!(usual.reference.name(), "fe-fine-linear-finite");
    assert_eq!(Ladder::usual(0).all(3).len(), 9);
}
