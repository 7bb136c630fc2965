//! The template's dimensions and place that lie closest to a surface, then the skin's offset.

use crate::clean::{Cleaned, clean};
use crate::least_squares::{Parameter, minimise};
use crate::placed::{Placed, distance_of};
use crate::skin::{Skin, offset};
use crate::{ScanError, Surface};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_fingertip::mesh::fingertip::check_elements;
use papilla_fingertip::scene::finger::{FIELDS, SKIN_FILE, Source, Thickness};
use papilla_fingertip::scene::{Finger, FingerError};
use papilla_sdf::{MeshDistance, Placement};
use papilla_vector::{cross, dot, minus, norm};

/// Rows and columns of the places where the template is compared with the surface.
const PLACES: [u32; 2] = [24, 32];
/// Largest root of the mean square that is accepted of the template, mm.
const MISFIT_MAX_MM: f64 = 2.0;
/// Largest distance of `--tip` from the surface, mm.
const TIP_MAX_MM: f64 = 5.0;
/// Widest finger, and widest surface round one, mm.
const ACROSS_MAX_MM: [f64; 2] = [40.0, 70.0];
/// Least length behind the tip, mm.
const LENGTH_MIN_MM: f64 = 12.0;
/// Share of places without a surface that is said; an open end alone leaves 3 %.
const MISSING: f64 = 0.05;
/// Distance from the skin that is said, mm.
const FAR_MM: f64 = 0.3;
/// Beyond this distance from the tip nothing is looked at, mm.
const BEYOND_MM: f64 = 60.0;
/// Longest way from the tip to the thickest section, in widths; the default finger has 0.65. Many
/// hand models grow up to the knuckle, and without a bound no body would be left behind that section.
const CAP_MAX: f64 = 0.85;
/// Shortest way, in widths.
const CAP_MIN: f64 = 0.15;
/// How much worse the template has to fit the other way round, to know where the nail is.
const WORSE: f64 = 1.2;

/// Where the finger is in the file, mm in its frame.
#[derive(Clone, Copy, Debug)]
pub struct Where {
    /// Foremost point of the finger.
    pub tip_mm: [f64; 3],
    /// From there along the finger towards the hand; of any length.
    pub axis: [f64; 3],
    /// Where the nail looks, about; found by the fit if not given.
    pub nail: Option<[f64; 3]>,
    /// Length of the model; in proportion to the width, as far as the surface goes, if not given.
    pub length_mm: Option<f64>,
}

/// What is not to be seen in a surface of the skin.
#[derive(Clone, Default)]
pub struct Inside<'a> {
    /// Layers, bone, nail and tissues by number; in proportion to the default finger's if not given.
    pub numbers: Option<&'a Finger>,
    /// The bone's surface, in the same frame.
    pub bone: Option<&'a Surface>,
    /// The nail plate's surface, in the same frame.
    pub nail: Option<&'a Surface>,
    /// Thickness of the epidermis, if it is known.
    pub epidermis: Option<Thickness>,
    /// Thickness of the dermis, if it is known.
    pub dermis: Option<Thickness>,
}

/// A fitted finger and how well it fits.
pub struct Fitted {
    /// The finger.
    pub finger: Finger,
    /// The surface in the finger's frame.
    pub surface: Placed,
    /// Root of the mean square of what the template alone leaves, mm.
    pub template_rms_mm: f64,
    /// The skin's offset, and what it leaves.
    pub skin: Skin,
    /// Least scaled Jacobian of the soft tissue.
    pub scaled_jacobian_min: f64,
    /// What was done to the surface, and what was assumed.
    pub done: Vec<String>,
}

/// Fits a finger to a surface.
///
/// # Errors
/// [`ScanError`] names the place for which there is no finger.
pub fn fit(scan: &Surface, at: &Where, inside: &Inside<'_>) -> Result<Fitted, ScanError> {
    let axis = direction(at.axis)?;
    let Cleaned { surface, cut, mut done } = clean(scan, axis)?;
    let distance = distance_of(&surface)?;
    require_tip(&distance, at.tip_mm)?;
    let along = |p: &[f64; 3]| dot(minus(*p, at.tip_mm), axis);
    let mean = surface.vertices_mm.iter().map(along).sum::<f64>();
    if mean < 0.0 {
        let why = "points out of the finger, or --tip is at the finger's other end";
        return Err(ScanError::Axis { axis: at.axis, why });
    }
    require_finger(&surface, at.tip_mm, axis)?;
    let near = cropped(&surface, |p| along(p) < BEYOND_MM);
    let rim_mm: Vec<[f64; 3]> = cut.iter().map(|&c| surface.vertices_mm[c as usize]).collect();
    let template = Template { surface: near, rim_mm, wanted_mm: at.length_mm };
    let (shape, placement, rms) = template.fit(at, axis)?;
    let surface = Placed::new(&template.surface, placement)?;
    let worst = template.worst(&shape, &surface);
    // NaN does not fit either.
    if !(rms <= MISFIT_MAX_MM) {
        let (uv, worst_mm, at_mm) = worst;
        let most_mm = MISFIT_MAX_MM;
        return Err(ScanError::Misfit { rms_mm: rms, most_mm, uv, worst_mm, at_mm });
    }
    let open = !template.rim_mm.is_empty();
    let skin = offset(&shape, &surface, open);
    if let Some(Err(source)) = skin.offset.as_ref().map(|o| o.validate()) {
        return Err(FingerError::Offset { path: SKIN_FILE.into(), source }.into());
    }
    say(&skin, &mut done);
    if shape.cap_length_mm > 0.999 * CAP_MAX * shape.width_mm {
        done.push(format!(
            "the surface grows thicker up to its end: the thickest section was taken to be {:.1} mm behind the \
             tip, {CAP_MAX} times the width",
            shape.cap_length_mm
        ));
    }
    let mut finger = numbered(shape, inside.numbers, &mut done);
    finger.shape.offset.clone_from(&skin.offset);
    if let Some(bone) = inside.bone {
        let bone = Placed::new(&clean(bone, axis)?.surface, placement)?;
        crate::bone::fit(&mut finger.shape, &bone, &surface, &mut done)?;
    }
    if let Some(nail) = inside.nail {
        crate::nail::fit(&mut finger.shape, nail, &placement, &surface, &mut done)?;
    }
    measured_layers(&mut finger.shape, inside, &mut done);
    finger.validate()?;
    let scaled_jacobian_min = check_elements(&finger.shape)?;
    Ok(Fitted { finger, surface, template_rms_mm: rms, skin, scaled_jacobian_min, done })
}

/// Puts in the layers' thickness that is known.
fn measured_layers(shape: &mut FingertipShape, inside: &Inside<'_>, done: &mut Vec<String>) {
    if let Some(epidermis) = inside.epidermis.clone() {
        (shape.epidermis_mm, shape.epidermis_map) = epidermis.parts();
        done.push("the epidermis is as thick as was given".into());
    }
    if let Some(dermis) = inside.dermis.clone() {
        (shape.dermis_mm, shape.dermis_map) = dermis.parts();
        done.push("the dermis is as thick as was given".into());
    }
}

/// Says where the skin is not the surface.
fn say(skin: &Skin, done: &mut Vec<String>) {
    let all = &skin.of_template_mm;
    let missing = all.iter().filter(|d| d.is_none()).count() as f64 / all.len() as f64;
    if missing > MISSING {
        done.push(format!(
            "at {:.0} % of the places no surface was met along the normal: the skin goes on smoothly there",
            100.0 * missing
        ));
    }
    if skin.worst_mm.abs() > FAR_MM {
        let [u, v] = skin.worst_uv;
        done.push(format!(
            "at u = {u:.2}, v = {v:.2} the surface is {:+.2} mm from the skin, which is too smooth to follow it: \
             look at the picture",
            skin.worst_mm
        ));
    }
}

/// The distance of a surface that need not be closed.
fn direction(axis: [f64; 3]) -> Result<[f64; 3], ScanError> {
    let size = norm(axis);
    if size > 0.0 && size.is_finite() {
        return Ok(axis.map(|v| v / size));
    }
    Err(ScanError::Axis { axis, why: "has no direction" })
}

fn require_tip(distance: &MeshDistance, tip: [f64; 3]) -> Result<(), ScanError> {
    use papilla_sdf::SignedDistance as _;
    let found = distance.distance(tip);
    let away_mm = found.gap_mm.abs();
    if away_mm <= TIP_MAX_MM {
        return Ok(());
    }
    let nearest_mm = std::array::from_fn(|i| tip[i] - found.gap_mm * found.normal[i]);
    Err(ScanError::Tip { away_mm, nearest_mm })
}

/// Refuses what is too wide for a finger, or too short.
fn require_finger(surface: &Surface, tip: [f64; 3], axis: [f64; 3]) -> Result<(), ScanError> {
    let [u, v] = across(axis);
    let along = |p: &[f64; 3]| dot(minus(*p, tip), axis);
    for (within_mm, most_mm) in [(45.0, ACROSS_MAX_MM[0]), (f64::INFINITY, ACROSS_MAX_MM[1])] {
        let near = || surface.vertices_mm.iter().filter(|p| along(p) < within_mm);
        for side in [u, v] {
            let reach = |p: &&[f64; 3]| dot(minus(**p, tip), side);
            let far = |p: &&[f64; 3], q: &&[f64; 3]| reach(p).total_cmp(&reach(q));
            if let (Some(low), Some(high)) = (near().min_by(far), near().max_by(far)) {
                let across_mm = reach(&high) - reach(&low);
                if across_mm > most_mm {
                    let (a, b) = (reach(&low).abs(), reach(&high).abs());
                    return Err(ScanError::Hand {
                        across_mm,
                        at_mm: if a > b { *low } else { *high },
                    });
                }
            }
        }
    }
    let length_mm = surface.vertices_mm.iter().map(along).fold(0.0, f64::max);
    if length_mm < LENGTH_MIN_MM {
        return Err(ScanError::Short { length_mm, least_mm: LENGTH_MIN_MM, open_mm: None });
    }
    Ok(())
}

/// Two unit vectors across a unit vector.
fn across(n: [f64; 3]) -> [[f64; 3]; 2] {
    let k = (0..3).min_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(0);
    let mut unit = [0.0; 3];
    unit[k] = 1.0;
    let u = cross(n, unit);
    let size = norm(u);
    let u = u.map(|v| v / size);
    [u, cross(n, u)]
}

/// The triangles with a corner for which `keeps` holds.
fn cropped(surface: &Surface, keeps: impl Fn(&[f64; 3]) -> bool) -> Surface {
    let kept = |t: &&[u32; 3]| t.iter().any(|&c| keeps(&surface.vertices_mm[c as usize]));
    Surface {
        vertices_mm: surface.vertices_mm.clone(),
        triangles: surface.triangles.iter().filter(kept).copied().collect(),
    }
}

/// What the template is fitted to.
struct Template {
    surface: Surface,
    rim_mm: Vec<[f64; 3]>,
    wanted_mm: Option<f64>,
}

/// Shape, place of the surface in the finger's frame, and root of the mean square that is left.
type Found = (FingertipShape, Placement, f64);

impl Template {
    /// With the nail where it was said, or where the template fits better.
    fn fit(&self, at: &Where, axis: [f64; 3]) -> Result<Found, ScanError> {
        if let Some(nail) = at.nail {
            let up = dot(nail, axis);
            let nail: [f64; 3] = std::array::from_fn(|i| nail[i] - up * axis[i]);
            let size = norm(nail);
            if !(size > 1e-6) {
                return Err(ScanError::Axis { axis: at.axis, why: "and --nail are parallel" });
            }
            return self.upright(at.tip_mm, axis, nail.map(|v| v / size));
        }
        let nail = self.flat_side(at.tip_mm, axis);
        let one = self.upright(at.tip_mm, axis, nail)?;
        let other = self.upright(at.tip_mm, axis, nail.map(|v| -v))?;
        let (best, rest) = if one.2 <= other.2 { (one, other) } else { (other, one) };
        if !(rest.2 >= WORSE * best.2 + 1e-3) {
            return Err(ScanError::NailSide { one_mm: best.2, other_mm: rest.2 });
        }
        Ok(best)
    }

    /// The direction across the axis along which the surface is flattest.
    fn flat_side(&self, tip: [f64; 3], axis: [f64; 3]) -> [f64; 3] {
        let [u, v] = across(axis);
        let mut sums = [0.0; 6];
        for t in &self.surface.triangles {
            let [a, b, c] = t.map(|c| minus(self.surface.vertices_mm[c as usize], tip));
            let area = norm(cross(minus(b, a), minus(c, a)));
            let middle: [f64; 3] = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0);
            let (x, p, q) = (dot(middle, axis), dot(middle, u), dot(middle, v));
            if (4.0..16.0).contains(&x) {
                let parts = [1.0, p, q, p * p, q * q, p * q];
                (0..6).for_each(|i| sums[i] += area * parts[i]);
            }
        }
        let [w, p, q, pp, qq, pq] = sums;
        let (a, b, c) =
            (pp / w - (p / w).powi(2), qq / w - (q / w).powi(2), pq / w - p * q / w / w);
        // The axis of the ellipse of inertia that is longest, and across it.
        let turn = 0.5 * (2.0 * c).atan2(a - b);
        let (s, k) = turn.sin_cos();
        std::array::from_fn(|i| -s * u[i] + k * v[i])
    }

    /// With the nail looking along `nail`, about.
    fn upright(&self, tip: [f64; 3], x: [f64; 3], nail: [f64; 3]) -> Result<Found, ScanError> {
        let y = cross(nail, x);
        let rotation = [x, y, nail];
        let origin_mm = rotation.map(|row| -dot(row, tip));
        let start = Placement { rotation, origin_mm };
        let moved = |p: &[f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| dot(rotation[i], *p) + origin_mm[i])
        };
        let own: Vec<[f64; 3]> = self.surface.vertices_mm.iter().map(moved).collect();
        let extent = |i: usize, within: f64| {
            let near = || own.iter().filter(|p| p[0] < within).map(|p| p[i]);
            let (low, high) =
                (near().fold(f64::INFINITY, f64::min), near().fold(f64::NEG_INFINITY, f64::max));
            (high - low, 0.5 * (low + high))
        };
        let ((width, _), (height, lift)) = (extent(1, 16.0), extent(2, 16.0));
        let usual = FingertipShape::default();
        let mut shape = FingertipShape {
            width_mm: width,
            height_mm: height,
            cap_length_mm: usual.cap_length_mm * width / usual.width_mm,
            crease_depth_mm: usual.crease_depth_mm * height / usual.height_mm,
            ..usual
        };
        shape.length_mm = self.length(&shape, &start)?;
        let raised =
            Placement { origin_mm: [origin_mm[0], origin_mm[1], origin_mm[2] - lift], ..start };
        let distance = distance_of(&self.surface)?;
        let mut found = self.adjust(&shape, &raised, &distance);
        // Once more, with the length that follows from the place and width that were found.
        found.0.length_mm = self.length(&found.0, &found.1)?;
        Ok(self.adjust(&found.0, &found.1, &distance))
    }

    /// Length of the model: as wanted, or in proportion to the width, up to the cut.
    fn length(&self, shape: &FingertipShape, placement: &Placement) -> Result<f64, ScanError> {
        let x = |p: &[f64; 3]| dot(placement.rotation[0], *p) + placement.origin_mm[0];
        let far = self.surface.vertices_mm.iter().map(x).fold(f64::NEG_INFINITY, f64::max);
        let open = self.rim_mm.iter().min_by(|p, q| x(p).total_cmp(&x(q)));
        // A closed end lies across the finger: 1 mm before it the skin is still whole.
        let there = open.map_or(far - 1.0, x);
        let usual = FingertipShape::default();
        let wanted = self.wanted_mm.unwrap_or(usual.length_mm / usual.width_mm * shape.width_mm);
        let length = wanted.min(there).min(range("length_mm")[1]);
        if length < LENGTH_MIN_MM.min(wanted) || self.wanted_mm.is_some_and(|w| w > there + 0.5) {
            let least_mm = self.wanted_mm.unwrap_or(LENGTH_MIN_MM);
            return Err(ScanError::Short { length_mm: there, least_mm, open_mm: open.copied() });
        }
        Ok(length)
    }

    /// Moves the surface and changes the dimensions until they lie closest.
    fn adjust(&self, shape: &FingertipShape, start: &Placement, distance: &MeshDistance) -> Found {
        let place = |start: f64, most: f64, step: f64| Parameter {
            start,
            range: [start - most, start + most],
            step,
        };
        let length = |start: f64, name: &str| {
            let range = range(name);
            Parameter { start: start.clamp(range[0], range[1]), range, step: 1e-3 }
        };
        let mut parameters = vec![place(0.0, 8.0, 1e-3); 3];
        parameters.extend([place(0.0, 0.5, 1e-4); 3]);
        parameters.extend([
            length(shape.width_mm, "width_mm"),
            length(shape.height_mm, "height_mm"),
            // In widths.
            Parameter {
                start: (shape.cap_length_mm / shape.width_mm).clamp(CAP_MIN, CAP_MAX),
                range: [CAP_MIN, CAP_MAX],
                step: 1e-4,
            },
            length(shape.cap_exponent, "cap_exponent"),
            length(shape.crease_depth_mm, "crease_depth_mm"),
        ]);
        let cap = range("cap_length_mm");
        let most = cap[1].min(shape.length_mm - 1.0);
        let shaped = |x: &[f64]| FingertipShape {
            width_mm: x[6],
            height_mm: x[7],
            cap_length_mm: (x[8] * x[6]).min(most).max(cap[0]),
            cap_exponent: x[9],
            crease_depth_mm: x[10].min(0.45 * x[7]),
            ..shape.clone()
        };
        let placed = |x: &[f64]| turned(start, [x[3], x[4], x[5]], [x[0], x[1], x[2]]);
        let places = places(self.end());
        let residuals = |x: &[f64]| -> Vec<f64> {
            let (shape, placement) = (shaped(x), placed(x));
            let gap = |(uv, weight): &([f64; 2], f64)| {
                let p = shape.template_skin(at_uv(*uv));
                weight * placement.distance(distance, p).gap_mm
            };
            places.iter().map(gap).collect()
        };
        let x = minimise(&parameters, &residuals);
        let (left, weights) = (residuals(&x), places.iter().map(|p| p.1 * p.1).sum::<f64>());
        let rms = (left.iter().map(|r| r * r).sum::<f64>() / weights).sqrt();
        (shaped(&x), placed(&x), rms)
    }

    /// Largest `v` at which the template is compared: up to an open end, the nearest place of the
    /// surface is its rim.
    fn end(&self) -> f64 {
        if self.rim_mm.is_empty() { 1.98 } else { 1.94 }
    }

    /// The place where the template is farthest from the surface.
    fn worst(&self, shape: &FingertipShape, surface: &Placed) -> ([f64; 2], f64, [f64; 3]) {
        let at = |(uv, _): ([f64; 2], f64)| {
            let p = shape.template_skin(at_uv(uv));
            (uv, surface.gap_mm(p), p)
        };
        let all = places(self.end()).into_iter().map(at);
        all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or_default()
    }
}

/// The range of a number of a finger's file.
fn range(shape: &str) -> [f64; 2] {
    FIELDS.iter().find(|f| f.shape == shape).map_or([0.0, f64::INFINITY], |f| f.range)
}

/// Places at which the template is compared with the surface, with the root of the part of the skin
/// that each stands for.
fn places(end: f64) -> Vec<([f64; 2], f64)> {
    let [rows, columns] = PLACES;
    let mut out = Vec::new();
    for i in 0..rows {
        let v = end * (f64::from(i) + 0.5) / f64::from(rows);
        let round = (std::f64::consts::FRAC_PI_2 * v.min(1.0)).sin();
        for j in 0..columns {
            let u = (f64::from(j) + 0.5 * f64::from(i % 2)) / f64::from(columns);
            out.push(([u, v], round.sqrt()));
        }
    }
    out
}

/// A place turned about the finger's x, y and z (rad), then moved.
fn turned(start: &Placement, [a, b, c]: [f64; 3], by_mm: [f64; 3]) -> Placement {
    let turn = |i: usize, j: usize, angle: f64, m: [[f64; 3]; 3]| {
        let (s, k) = angle.sin_cos();
        let mut out = m;
        out[i] = std::array::from_fn(|n| k * m[i][n] - s * m[j][n]);
        out[j] = std::array::from_fn(|n| s * m[i][n] + k * m[j][n]);
        out
    };
    let both = |m| turn(0, 1, c, turn(2, 0, b, turn(1, 2, a, m)));
    // A shift is a column that is turned with the rest.
    let columns = [start.origin_mm, [0.0; 3], [0.0; 3]];
    let as_rows = std::array::from_fn(|i| [columns[0][i], 0.0, 0.0]);
    let shifted: [[f64; 3]; 3] = both(as_rows);
    Placement {
        rotation: both(start.rotation),
        origin_mm: std::array::from_fn(|i| shifted[i][0] + by_mm[i]),
    }
}

/// What cannot be seen from outside: by number, or in proportion to the default finger.
fn numbered(shape: FingertipShape, numbers: Option<&Finger>, done: &mut Vec<String>) -> Finger {
    let usual = Finger::usual();
    if let Some(Finger { shape: n, tissue, .. }) = numbers {
        done.push("layers, bone, nail and tissues are those of the numbers that were given".into());
        let shape = FingertipShape {
            length_mm: shape.length_mm,
            width_mm: shape.width_mm,
            height_mm: shape.height_mm,
            cap_length_mm: shape.cap_length_mm,
            cap_exponent: shape.cap_exponent,
            crease_depth_mm: shape.crease_depth_mm,
            offset: None,
            ..n.clone()
        };
        return Finger { shape, tissue: tissue.clone(), source: Source::default() };
    }
    done.push(
        "nothing was measured inside: layers, bone and nail are in proportion to the default finger's"
            .into(),
    );
    let u = &usual.shape;
    let wide = shape.width_mm / u.width_mm;
    let high = shape.height_mm / u.height_mm;
    let long = shape.cap_length_mm / u.cap_length_mm;
    let section = |of: [f64; 2]| [wide * of[0], high * of[1]];
    let shape = FingertipShape {
        epidermis_mm: (wide * high).sqrt() * u.epidermis_mm,
        dermis_mm: (wide * high).sqrt() * u.dermis_mm,
        bone_tip_mm: long * u.bone_tip_mm,
        bone_cap_mm: long * u.bone_cap_mm,
        bone_offset_mm: high * u.bone_offset_mm,
        bone_tuft_mm: section(u.bone_tuft_mm),
        bone_waist_mm: section(u.bone_waist_mm),
        bone_base_mm: section(u.bone_base_mm),
        bone_cortex_mm: wide.min(high) * u.bone_cortex_mm,
        nail_mm: [wide * u.nail_mm[0], long * u.nail_mm[1]],
        nail_tip_mm: long * u.nail_tip_mm,
        ..shape
    };
    Finger { shape, tissue: usual.tissue, source: Source::default() }
}
