use papilla_proto::effects::Tissue;

use super::*;

fn compliance(creep: &Creep, t: f64) -> f64 {
    creep.long_term - creep.branches.iter().map(|(x, j)| j * (-x * t).exp()).sum::<f64>()
}

fn filter(of: &Parameters) -> Relaxation {
    Relaxation::new(of).unwrap()
}

/// One step with the same pressure everywhere; what comes out everywhere.
fn step(filter: &mut Relaxation, pressure_pa: f32, time_us: u64) -> f32 {
    let mut map = vec![pressure_pa; MAP_LEN];
    let peak_pa = filter.step(&mut map, time_us);
    assert!(map.iter().all(|pa| pa.to_bits() == peak_pa.to_bits()));
    assert_eq!(filter.sent_pa()[7].to_bits(), pressure_pa.to_bits());
    peak_pa
}

#[test]
fn one_term_inverts_to_the_standard_solid() {
    // G = 0.4 + 0.6 exp(-t / 2): J = 2.5 - 1.5 exp(-t / 5).
    let creep = Creep::of(&[PronyTerm { g: 0.6, tau_s: 2.0 }]).unwrap();
    assert!((creep.long_term - 2.5).abs() < 1e-12);
    let [(x, j)] = creep.branches[..] else { panic!("one term, one branch") };
    assert!((x - 0.2).abs() < 1e-12 && (j - 1.5).abs() < 1e-11, "{x} {j}");
}

#[test]
fn creep_and_relaxation_undo_each_other() {
    // integral G(t - s) dJ(s) = 1 at all times, here by the midpoint rule.
    let six: Vec<_> =
        (0..6).map(|i| PronyTerm { g: 0.1, tau_s: 10f64.powi(i - 3) * 1.7 }).collect();
    for terms in [&Tissue::Skin.prony()[..], &Tissue::Subcutaneous.prony(), &six] {
        let creep = Creep::of(terms).unwrap();
        assert!((compliance(&creep, 0.0) - 1.0).abs() < 1e-9, "J(0) = 1 / G(0)");
        let relaxed = |t: f64| {
            1.0 - terms.iter().map(|term| term.g * -(-t / term.tau_s).exp_m1()).sum::<f64>()
        };
        for t in [0.05, 1.0, 20.0] {
            let steps = 200_000;
            let h = t / f64::from(steps);
            let mut sum = relaxed(t);
            for n in 0..steps {
                let s = f64::from(n) * h;
                let rise = compliance(&creep, s + h) - compliance(&creep, s);
                sum += relaxed(t - s - 0.5 * h) * rise;
            }
            assert!((sum - 1.0).abs() < 1e-4, "{sum} at {t} s");
        }
    }
}

#[test]
fn a_step_is_answered_exactly_whatever_the_time_step() {
    let creep = Creep::of(&Tissue::default().prony()).unwrap();
    for step_us in [1, 900, 11_111, 333_333, 7_000_000] {
        let mut filter = filter(&Parameters::default());
        for n in 0..20 {
            let time_us = 77_000_000 + n * step_us;
            let due = 1000.0 * compliance(&creep, (n * step_us) as f64 * 1e-6);
            let found = f64::from(step(&mut filter, 1000.0, time_us));
            assert!((found - due).abs() < 1e-5 * due, "{found}, not {due}, {n} x {step_us} us");
        }
    }
}

#[test]
fn a_ramp_is_answered_exactly_too() {
    // integral of J over the ramp: slope (J_inf t - sum j/x (1 - exp(-x t))).
    let creep = Creep::of(&Tissue::default().prony()).unwrap();
    let ramp = |t: f64| {
        let branch = |&(x, j): &(f64, f64)| j / x * -(-x * t).exp_m1();
        500.0 * (creep.long_term * t - creep.branches.iter().map(branch).sum::<f64>())
    };
    for step_us in [5_000, 100_000, 1_500_000] {
        let mut filter = filter(&Parameters::default());
        for n in 0..12 {
            let t = (n * step_us) as f64 * 1e-6;
            let found = f64::from(step(&mut filter, (500.0 * t) as f32, n * step_us));
            assert!((found - ramp(t)).abs() < 2e-5 * ramp(t).max(1.0), "{found} at {t} s");
        }
    }
}

#[test]
fn a_release_fades_to_nothing_and_never_below() {
    let mut filter = filter(&Parameters::default());
    step(&mut filter, 20_000.0, 0);
    step(&mut filter, 20_000.0, 3_000_000);
    let mut last = step(&mut filter, 0.0, 3_000_000);
    assert!(last > 1000.0, "strain stays behind at first: {last} Pa");
    for n in 1..600 {
        let now = step(&mut filter, 0.0, 3_000_000 + n * 500_000);
        assert!((0.0..=last).contains(&now), "{now} after {last}");
        last = now;
    }
    assert!(last <= 0.0, "{last} Pa after five minutes");
    assert!(filter.branches.iter().all(|b| b.state_pa.iter().all(|s| s.abs() <= 0.0)));
}

#[test]
fn long_term_moduli_end_where_the_elastic_map_is() {
    let mut filter = filter(&Parameters { moduli: Moduli::LongTerm, ..Parameters::default() });
    let first = step(&mut filter, 1000.0, 0);
    assert!((first - 1000.0 * (1.0 - 0.0864 - 0.2136)).abs() < 0.01, "{first}");
    let last = step(&mut filter, 1000.0, 600_000_000);
    assert!((last - 1000.0).abs() < 0.01, "{last}");
}

#[test]
fn series_that_make_no_solid_are_refused() {
    let term = |g, tau_s| PronyTerm { g, tau_s };
    for (prony, word) in [
        (vec![], "0 Prony terms"),
        (vec![term(0.01, 1.0); 7], "7 Prony terms"),
        (vec![term(0.6, 1.0), term(0.4, 2.0)], "1 %"),
        (vec![term(0.1, 1.0), term(0.1, 1.0)], "make them one"),
        (vec![term(-0.1, 1.0)], "term 0"),
        (vec![term(0.1, 0.0)], "term 0"),
        (vec![term(0.1, 1.0), term(f64::NAN, 1.0)], "term 1"),
    ] {
        let of = Parameters { prony: Some(prony), ..Parameters::default() };
        let problem = Relaxation::new(&of).unwrap_err();
        assert!(problem.message.contains(word), "{problem}");
    }
}
