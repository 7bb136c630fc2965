//! Where engines say that a finger and objects are, for the cases that place a body with a client's own
//! conversion. By matrices throughout: the clients convert quaternions, so the two check each other.

use serde_json::{Value, json};

use super::pair;

type Matrix = [[f64; 3]; 3];

/// How an engine counts: the rows of the matrix that takes its axes to the finger's frame, and mm in one
/// of its units of length.
struct Engine {
    name: &'static str,
    rows: Matrix,
    unit_mm: f64,
    /// A tracked joint's own axes in those of the finger, both the engine's; none: it tracks no hands.
    joint: Option<Matrix>,
}

const SAME: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// Back, right, up: +z, +x, +y.
const OPENXR: Matrix = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

const ENGINES: [Engine; 5] = [
    Engine { name: "right_handed", rows: SAME, unit_mm: 1000.0, joint: None },
    Engine { name: "openxr", rows: OPENXR, unit_mm: 1000.0, joint: Some(SAME) },
    // Joints as Godot's humanoid skeleton has them: +y to the tip, -z out of the nail.
    Engine {
        name: "godot",
        rows: OPENXR,
        unit_mm: 1000.0,
        joint: Some([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]]),
    },
    // Left-handed: -z, +x, +y; and -x, +y, +z.
    Engine {
        name: "unity",
        rows: [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        unit_mm: 1000.0,
        joint: Some(SAME),
    },
    Engine {
        name: "unreal",
        rows: [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        unit_mm: 10.0,
        joint: Some(SAME),
    },
];

/// How far the tip's joint lies inside the skin, and the joint of the distal phalanx behind the tip, mm.
const INSIDE_MM: f64 = 2.5;
const DISTAL_MM: f64 = 24.0;
/// The distal joint is turned against the line to the tip, about the finger's y: cosine and sine.
const BENT: (f64, f64) = (0.96, 0.28);

fn times(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn turned(a: Matrix, v: [f64; 3]) -> [f64; 3] {
    a.map(|row| row.iter().zip(v).map(|(a, v)| a * v).sum())
}

/// A rotation and a place, of seven numbers.
fn read([x, y, z, a, b, c, d]: [f64; 7]) -> (Matrix, [f64; 3]) {
    let size = a * a + b * b + c * c + d * d;
    let turn = [
        [d * d + a * a - b * b - c * c, 2.0 * (a * b - c * d), 2.0 * (a * c + b * d)],
        [2.0 * (a * b + c * d), d * d - a * a + b * b - c * c, 2.0 * (b * c - a * d)],
        [2.0 * (a * c - b * d), 2.0 * (b * c + a * d), d * d - a * a - b * b + c * c],
    ];
    (turn.map(|row| row.map(|v| v / size)), [x, y, z])
}

/// Nine digits: what an engine's doubles hold, and the same on every machine.
fn rounded(v: f64) -> f64 {
    // Minus zero is zero.
    format!("{v:.8e}").parse::<f64>().map_or(v, |v| v + 0.0)
}

/// The seven numbers of a rotation and a place: the quaternion by its largest member.
fn written(r: Matrix, at: [f64; 3]) -> [f64; 7] {
    let [[m00, m01, m02], [m10, m11, m12], [m20, m21, m22]] = r;
    let squares = [
        1.0 + m00 - m11 - m22,
        1.0 - m00 + m11 - m22,
        1.0 - m00 - m11 + m22,
        1.0 + m00 + m11 + m22,
    ];
    let products = [
        [squares[0], m01 + m10, m02 + m20, m21 - m12],
        [m01 + m10, squares[1], m12 + m21, m02 - m20],
        [m02 + m20, m12 + m21, squares[2], m10 - m01],
        [m21 - m12, m02 - m20, m10 - m01, squares[3]],
    ];
    let most = (0..4).max_by(|&i, &j| squares[i].total_cmp(&squares[j])).unwrap_or(3);
    let [x, y, z] = at;
    let [a, b, c, d] = products[most].map(|v| 0.5 * v / squares[most].sqrt());
    [x, y, z, a, b, c, d].map(rounded)
}

/// A body's frame as this engine has it.
fn of(engine: &Engine, turn: Matrix, at_mm: [f64; 3]) -> (Matrix, [f64; 3]) {
    let back = transposed(engine.rows);
    let place = turned(back, at_mm).map(|v| v / engine.unit_mm);
    (times(times(back, turn), engine.rows), place)
}

/// The world's place, mm, of a place in the finger's frame.
fn out(finger: (Matrix, [f64; 3]), at_mm: [f64; 3]) -> [f64; 3] {
    let moved = turned(finger.0, at_mm);
    std::array::from_fn(|i| moved[i] + finger.1[i])
}

/// What each engine says of a finger, whose frame lies at `world` in a world whose axes are the finger's
/// (back, right, up; mm), of its joints, and of objects at `poses` in the finger's frame.
pub(super) fn inputs(world: [f64; 7], poses: &[[f64; 7]]) -> Value {
    let finger = read(world);
    let mut all = json!({});
    for engine in &ENGINES {
        let seven = |turn: Matrix, at_mm: [f64; 3]| {
            let (turn, place) = of(engine, turn, at_mm);
            written(turn, place)
        };
        let object = |pose: &[f64; 7]| {
            let (turn, at_mm) = read(*pose);
            seven(times(finger.0, turn), out(finger, at_mm))
        };
        let objects: Vec<[f64; 7]> = poses.iter().map(object).collect();
        let mut said = json!({ "finger": seven(finger.0, finger.1), "objects": objects });
        if let Some(own) = engine.joint {
            let (cos, sin) = BENT;
            let bent = times(finger.0, [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]);
            let joint = |turn: Matrix, behind_mm: f64| {
                let (turn, place) = of(engine, turn, out(finger, [behind_mm, 0.0, 0.0]));
                written(times(turn, own), place)
            };
            said["joints"] = json!({
                "distal": joint(bent, DISTAL_MM), "tip": joint(finger.0, INSIDE_MM), "inside_mm": INSIDE_MM,
            });
        }
        all[engine.name] = said;
    }
    all
}

/// What pushes back, in each engine's world: force N, torque N m, centre of the pressure in its unit; with
/// what each may be off.
pub(super) fn felt(world: [f64; 7], touch: &[f64], tolerances: &[(f64, f64)]) -> Value {
    let finger = read(world);
    let three = |first: usize| -> [f64; 3] { std::array::from_fn(|i| touch[first + i]) };
    // A vector is as far off as the worst of its members, wherever it points.
    let off = |first: usize| {
        let of = |i: usize| tolerances[i].0 * touch[i].abs() + tolerances[i].1;
        (first..first + 3).map(of).fold(0.0, f64::max)
    };
    let mut all = json!({});
    for engine in &ENGINES {
        let back = transposed(engine.rows);
        let [a, b, c] = engine.rows;
        let handed = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        let pairs = |v: [f64; 3], off: f64| v.map(|v| pair((&v, (0.0, off))));
        let force = turned(back, turned(finger.0, three(0)));
        // N mm to N m; a turning changes its sign with the hand.
        let torque = turned(back, turned(finger.0, three(3))).map(|v| 1e-3 * handed * v);
        let centre = turned(back, out(finger, three(7))).map(|v| v / engine.unit_mm);
        all[engine.name] = json!({
            "force_n": pairs(force, off(0)),
            "torque_n_m": pairs(torque, 1e-3 * off(3)),
            "centre": pairs(centre, off(7) / engine.unit_mm),
        });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The finger points ahead, level, its nail up; the object is 11.25 mm behind its end, 2 mm to the right,
    /// 8 mm below. Written by hand.
    #[test]
    fn a_level_finger_is_what_each_engine_s_manual_says() {
        let said = inputs(
            [0.0, 0.0, 1000.0, 0.0, 0.0, 0.0, 1.0],
            &[[11.25, 2.0, -8.0, 0.0, 0.0, 0.0, 1.0]],
        );
        for (name, finger, object) in [
            ("right_handed", [0.0, 0.0, 1.0], [0.01125, 0.002, 0.992]),
            // x right, y up, z back.
            ("openxr", [0.0, 1.0, 0.0], [0.002, 0.992, 0.01125]),
            ("godot", [0.0, 1.0, 0.0], [0.002, 0.992, 0.01125]),
            // x right, y up, z ahead.
            ("unity", [0.0, 1.0, 0.0], [0.002, 0.992, -0.01125]),
            // x ahead, y right, z up; cm.
            ("unreal", [0.0, 0.0, 100.0], [-1.125, 0.2, 99.2]),
        ] {
            let place = |of: &Value| of.as_array().unwrap()[..3].to_vec();
            assert_eq!(json!(place(&said[name]["finger"])), json!(finger), "{name}");
            assert_eq!(json!(place(&said[name]["objects"][0])), json!(object), "{name}");
            assert_eq!(
                json!(said[name]["finger"].as_array().unwrap()[3..]),
                json!([0.0, 0.0, 0.0, 1.0])
            );
        }
    }

    /// Turned to the right by 90 degrees, seen from above. Quaternions of the manuals: about y (up) by -90
    /// degrees in OpenXR, by +90 in Unity; about z by +90 in Unreal.
    #[test]
    fn a_turn_to_the_right_is_what_each_engine_s_manual_says() {
        let half = 0.5f64.sqrt();
        let said =
            inputs([0.0, 0.0, 0.0, 0.0, 0.0, -half, half], &[[10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]);
        let half = rounded(half);
        for (name, turn, object) in [
            ("openxr", [0.0, -half, 0.0, half], [-0.01, 0.0, 0.0]),
            ("unity", [0.0, half, 0.0, half], [-0.01, 0.0, 0.0]),
            ("unreal", [0.0, 0.0, half, half], [0.0, -1.0, 0.0]),
        ] {
            let found: Vec<f64> = serde_json::from_value(said[name]["finger"].clone()).unwrap();
            let sign = if found[6] < 0.0 { -1.0 } else { 1.0 };
            for (found, due) in found[3..].iter().zip(turn) {
                assert!((sign * found - due).abs() < 1e-8, "{name}: {found} {due}");
            }
            let found: Vec<f64> = serde_json::from_value(said[name]["objects"][0].clone()).unwrap();
            for (found, due) in found.iter().zip(object) {
                assert!((found - due).abs() < 1e-8, "{name}: {found} {due}");
            }
        }
    }
}
