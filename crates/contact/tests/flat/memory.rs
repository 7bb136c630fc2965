//! A warm start that goes elsewhere: the same frame gets the same bits.

use papilla_contact::{Contact, Memory, NetForce, Settings, Solver};

use super::support::{ball, model, small_strain, solver};

/// Where a ball is in a frame: it rolls, jumps, leaves and comes back.
fn way(frame: u32) -> ([f64; 2], f64) {
    let step = f64::from(frame);
    let depth_mm = if frame % 7 == 6 { -3.0 } else { 0.05 + 0.04 * (1.7 * step).sin() };
    ([0.5 * (0.9 * step).sin(), 0.3 * (1.3 * step).cos()], depth_mm)
}

fn elsewhere(of: &Solver, settings: Settings) -> Solver {
    let mut other = Solver::new(model(), settings).expect("a solver");
    assert!(other.recall(&of.memory()));
    other
}

#[test]
fn a_frame_after_a_recall_is_the_frame_that_would_have_been() {
    let settings = Settings { stiffness: true, ..small_strain() };
    let (mut stays, mut out) = solver(settings);
    let (mut differs, mut effort) = (0, 0);
    for frame in 0..40 {
        let mut moved = elsewhere(&stays, settings);
        let (mut anew, mut of_anew) = solver(settings);
        let mut of_moved = Contact::new(model().vertices());
        let (at, depth_mm) = way(frame);
        let things = [ball(8.0, at, depth_mm)];
        stays.solve(&things, &mut out).expect("an answer");
        moved.solve(&things, &mut of_moved).expect("an answer");
        anew.solve(&things, &mut of_anew).expect("an answer");
        assert_eq!(out, of_moved, "frame {frame}");
        assert_eq!(stays.memory(), moved.memory(), "frame {frame}");
        differs += u32::from(of_anew != out);
        effort += out.effort.iterations;
    }
    assert!(differs > 20 && effort > 40, "only {differs} frames are other without a warm start");
}

#[test]
fn a_net_force_goes_on_from_where_it_was_met() {
    let (mut stays, mut out) = solver(small_strain());
    for force_n in [0.02, 0.03, 0.01, 0.025] {
        let mut moved = elsewhere(&stays, small_strain());
        let mut of_moved = Contact::new(model().vertices());
        let net = NetForce { direction: [0.0, 0.0, 1.0], force_n };
        let things = [ball(8.0, [0.1, 0.0], 0.0)];
        let due_mm = stays.solve_for_force(&things, net, &mut out).expect("an answer");
        let mm = moved.solve_for_force(&things, net, &mut of_moved).expect("an answer");
        assert_eq!((mm.to_bits(), &of_moved), (due_mm.to_bits(), &out), "{force_n} N");
    }
}

#[test]
fn a_memory_that_fits_no_patch_is_as_good_as_none() {
    let (mut warm, mut out) = solver(small_strain());
    warm.solve(&[ball(8.0, [0.0; 2], 0.06)], &mut out).expect("an answer");
    let good = warm.memory();
    assert!(good.near > 1 && good.made == good.near, "{good:?}");
    let mut twice = good.clone();
    twice.vertices[0] = twice.vertices[1];
    let mut outside = good.clone();
    outside.vertices[0] = 100_000;
    for bad in [
        twice,
        outside,
        Memory { near: good.vertices.len() + 1, ..good.clone() },
        Memory { made: good.near - 1, ..good.clone() },
        Memory { stride: good.stride + 1, ..good.clone() },
        Memory { stride: 0, ..good.clone() },
        Memory { stride: 1 << 20, ..good.clone() },
        Memory { forces_n: Vec::new(), ..good.clone() },
        Memory { made_with: Vec::new(), ..good },
    ] {
        let (mut other, mut found) = solver(small_strain());
        assert!(!other.recall(&bad), "{bad:?}");
        assert!(other.memory().vertices.is_empty(), "{bad:?}");
        other.solve(&[ball(8.0, [0.0; 2], 0.06)], &mut found).expect("an answer");
        assert_eq!(found, out, "not from nothing");
    }
}
