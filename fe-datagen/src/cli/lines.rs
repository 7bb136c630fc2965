//! What `solve` writes of a plane section: values along the skin.

use papilla_atlas::PA_PER_MPA;
use papilla_fingertip::scene::{Output, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_output::OutputError;
use papilla_output::npz::NpzBuilder;
use papilla_output::plot::{Axis, Chart, Mark, Series, write_svg};
use std::path::Path;

/// Values of a state along the skin.
type Values = fn(&IncrementRecord) -> &Vec<f64>;

/// States that are drawn; more would hide each other.
const CURVES_MAX: usize = 5;

/// Writes `lines.npz` of all states and a plot of pressure and of SED, as far as the
/// scene asks for them.
pub(super) fn write(
    folder: &Path,
    scene: &Scene,
    setup: &Simulation,
    records: &[IncrementRecord],
) -> Result<(), OutputError> {
    let (body, timed) = (&setup.body, setup.drive.is_timed());
    let (Some(pressed), Some(_)) = (&body.patch, records.last()) else { return Ok(()) };
    let at = |nodes: &[u32]| -> Vec<[f64; 2]> {
        let position = |&n: &u32| body.problem.mesh.nodes[n as usize];
        nodes.iter().map(position).map(|[x, y, _]| [x, y]).collect()
    };
    let (skin, interface) = (at(&pressed.patch.skin), at(&pressed.patch.interface));
    let mut npz = NpzBuilder::new();
    npz.add_slice("skin_mm", &[skin.len(), 2], skin.as_flattened())?;
    npz.add_slice("interface_mm", &[interface.len(), 2], interface.as_flattened())?;
    let states = |get: fn(&IncrementRecord) -> f64| records.iter().map(get).collect::<Vec<_>>();
    npz.add_slice("depth_mm", &[records.len()], &states(|r| r.depth_mm))?;
    npz.add_slice("time_s", &[records.len()], &states(|r| r.time_s))?;
    let fields: [(&str, Values); 3] = [
        ("pressure_pa", |r| &r.pressure_mpa),
        ("sed_dermis_j_per_m3", |r| &r.sed_dermis_mpa),
        ("sed_epidermis_j_per_m3", |r| &r.sed_epidermis_mpa),
    ];
    for (name, get) in fields {
        let values: Vec<f64> = records.iter().flat_map(get).map(|v| v * PA_PER_MPA).collect();
        npz.add_slice(name, &[records.len(), skin.len()], &values)?;
    }
    if scene.writes(Output::Maps) {
        npz.write(&folder.join("lines.npz"))?;
    }
    if !scene.writes(Output::Pictures) {
        return Ok(());
    }
    let label = |r: &IncrementRecord| {
        if timed { format!("{:.2} s", r.time_s) } else { format!("{:.2} mm", r.depth_mm) }
    };
    let plots: [(&str, &str, &str, &[[f64; 2]], _); 2] = [
        ("pressure", "Pressure on the skin", "pressure, Pa", &skin, fields[0].1),
        ("sed", "SED at the interface, dermis side", "SED, J/m3", &interface, fields[1].1),
    ];
    for (stem, title, axis, places, get) in plots {
        let series = chosen(records.len())
            .map(|i| {
                let values = get(&records[i]).iter().map(|v| v * PA_PER_MPA);
                let points = places.iter().zip(values).map(|(p, v)| (p[0], v)).collect();
                Series { name: label(&records[i]), points, mark: Mark::Line }
            })
            .collect();
        let mut chart =
            Chart { title: title.into(), x: Axis::linear("x, mm"), y: Axis::linear(axis), series };
        trim(&mut chart);
        write_svg(&folder.join(stem).with_extension("svg"), &chart)?;
    }
    Ok(())
}

/// Indices of at most [`CURVES_MAX`] states, evenly spread, the last among them.
fn chosen(states: usize) -> impl Iterator<Item = usize> {
    let count = states.min(CURVES_MAX);
    (1..=count).map(move |k| k * states / count - 1)
}

/// Leaves out what lies beyond 1.2 times the farthest x with more than 1 % of the
/// largest value.
fn trim(chart: &mut Chart) {
    let points = || chart.series.iter().flat_map(|s| &s.points);
    let largest = points().map(|p| p.1).fold(0.0, f64::max);
    let far = points().filter(|p| p.1 > 0.01 * largest).map(|p| p.0.abs()).fold(0.0, f64::max);
    for series in &mut chart.series {
        series.points.retain(|p| p.0.abs() <= 1.2 * far);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_state_is_always_drawn() {
        let of = |n| chosen(n).collect::<Vec<_>>();
        assert_eq!(of(1), [0]);
        assert_eq!(of(3), [0, 1, 2]);
        assert_eq!(of(11), [1, 3, 5, 7, 10]);
    }

    #[test]
    fn a_chart_shows_what_is_pressed() {
        let points = (0..=80).map(|k| 0.1 * f64::from(k)).map(|x| (x, (-4.0 * x).exp())).collect();
        let mut chart = Chart {
            title: String::new(),
            x: Axis::linear(""),
            y: Axis::linear(""),
            series: vec![Series { name: String::new(), points, mark: Mark::Line }],
        };
        trim(&mut chart);
        let (end, _) = chart.series[0].points[chart.series[0].points.len() - 1];
        assert!(end > 1.2 && end < 1.5, "{end}");
    }
}
