//! A record that the model itself made is fitted again.

use super::objective::Data;
use super::parameters::{PARAMETERS, RELAXATION};
use super::record::{RecordedPress, RecordedSample};
use super::*;
use crate::people::press::Cells;
use papilla_sdf::{IndenterSpec, Plate, Sphere};

/// Samples of a press that reaches `deepest_mm` within `time_s`, without forces.
fn asked(name: &str, indenter: IndenterSpec, deepest_mm: f64, time_s: f64) -> RecordedPress {
    let sample = |k: u32| {
        let part = f64::from(k) / 8.0;
        RecordedSample { time_s: part * time_s, depth_mm: part * deepest_mm, force_n: 1.0 }
    };
    RecordedPress {
        name: name.into(),
        indenter,
        pitch_deg: 0.0,
        samples: (1..=8).map(sample).collect(),
    }
}

/// The forces come back, the constants that they tell too, and constants that shallow presses cannot
/// feel are called so.
#[test]
#[ignore = "long"]
fn a_record_that_was_simulated_is_fitted_again() {
    let folder = tempfile::tempdir().unwrap();
    let plate = IndenterSpec::Plate(Plate { size_mm: [30.0, 30.0], ..Plate::default() });
    let ball = IndenterSpec::Sphere(Sphere { radius_mm: 3.0 });
    let mut presses = vec![
        asked("slow plate", plate.clone(), 0.8, 20.0),
        asked("fast plate", plate, 0.8, 0.1),
        asked("ball", ball, 1.0, 20.0),
    ];
    let truth = [0.7, 0.5, 0.4, 0.6, 0.6, 0.5, 0.5, 0.4, 0.4, 0.2];
    let relaxes = [0.2, 0.4, 0.3];
    let data = Data::recorded(presses.clone());
    let subject = simulated::subject(&Moved::named(&[]), &truth);
    let solved = data.solved(&subject, Cells::COARSE, folder.path()).unwrap();
    let features = data.features(&subject, &solved).unwrap();
    let forces = data.here(&features, &relaxes);
    let samples = presses.iter_mut().flat_map(|p| &mut p.samples);
    samples.zip(&forces).for_each(|(s, f)| s.force_n = *f);
    let options = Options {
        moved: Moved::named(&[]),
        design: 20,
        rounds: 8,
        graded: 0,
        only: vec!["constants".into()],
    };
    let records = vec![("made.csv".to_owned(), presses)];
    let measured = Measured::shipped().unwrap();
    let fit = run(&measured, records, &options, folder.path(), &mut |_, _, _| ()).unwrap();
    assert!(fit.cost[1] < 0.05 * fit.cost[0], "{:?}", fit.cost);
    assert!(fit.rows.iter().all(|r| r.met), "{:?}", fit.rows);
    // The modulus of fat, to which everything is in proportion, and one that shallow presses do not feel.
    let value = |k: usize| &fit.constants[k];
    let fat = PARAMETERS[0].value(truth[0]);
    assert!(value(0).told.low <= fat && fat <= value(0).told.high, "{:?}", value(0));
    assert!(value(0).told.share < 0.9, "{:?}", value(0));
    assert_eq!(value(8).told.word(), "not told", "{:?}", value(8));
    // The fast press tells what relaxes with 70 ms.
    let relaxing = &fit.constants[PARAMETERS.len() + 1];
    let exact = RELAXATION[1].value(relaxes[1]);
    assert!(relaxing.told.low <= exact && exact <= relaxing.told.high, "{relaxing:?}");
    // The finger is a file that scenes can name.
    let finger = Finger::read(folder.path()).unwrap();
    assert_eq!(finger.shape, fit.finger.shape);
}
