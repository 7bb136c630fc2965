//! A half-space whose vertices are .7 mm apart, and pixels between them.

use papilla_atlas::{Atlas, MAP_SIDE_PX, Patch, PatchVertices, Raster};
use papilla_contact::{
    Arrays, Contact, ContactModel, Header, Layer, Method, PixelContact, PixelSkin, PixelSpacing,
    Settings, Solver,
};
use std::f64::consts::PI;
use std::sync::Arc;

/// Vertices of a side, and pixels between them.
const SIDE: usize = 15;
const SPACING_PX: f64 = 14.0;
pub(crate) const PITCH_MM: f64 = 0.05;
/// E / (1 - nu^2), MPa.
pub(crate) const MODULUS_MPA: f64 = 0.2;
const POISSON: f64 = 0.48;
/// E* = 4 G of what is incompressible.
pub(crate) const SHEAR_MODULUS_MPA: f64 = MODULUS_MPA / 4.0;
/// Where the skin's last row of vertices stands, and the map ends: x, mm.
pub(crate) const END_MM: f64 = (SIDE - 1) as f64 / 2.0 * SPACING_PX * PITCH_MM;

/// Place of a point of the map on the plane.
fn place_mm([u, v]: [f64; 2]) -> [f64; 2] {
    let middle = MAP_SIDE_PX as f64 / 2.0;
    [(v - middle) * PITCH_MM, (middle - u) * PITCH_MM]
}

pub(crate) struct Plane {
    pub solver: Solver,
    pub pixels: PixelContact,
    pub raster: Arc<Raster>,
    pub out: Contact,
}

/// A half-space.
pub(crate) fn plane() -> Plane {
    plane_of(1.0, PixelSpacing::One)
}

/// The same, of a mesh on which a force moves its own vertex `own` times as far, and the eight
/// round it as much less: an even load moves all as before.
pub(crate) fn plane_of(own: f32, spacing: PixelSpacing) -> Plane {
    with_compliance(spacing, |arrays| {
        let more = (own - 1.0) * arrays.compliance_mm_per_n[2 * (3 * SIDE * SIDE) - 1];
        let mut values = arrays.compliance_mm_per_n.iter_mut();
        for i in 0..3 * SIDE * SIDE {
            for k in i..3 * SIDE * SIDE {
                let value = values.next().expect("an upper triangle");
                let [p, q] = [i / 3, k / 3];
                let is_beside = |[a, b]: [usize; 2]| a.abs_diff(b) <= 1;
                if [i % 3, k % 3] != [2, 2] {
                    continue;
                } else if p == q {
                    *value += more;
                } else if is_beside([p / SIDE, q / SIDE]) && is_beside([p % SIDE, q % SIDE]) {
                    *value -= more / 8.0;
                }
            }
        }
    })
}

/// The half of it at `x <= END_MM`, of a body that is alike on both sides: what stands at its end
/// slides in that plane.
pub(crate) fn half_plane(spacing: PixelSpacing) -> Plane {
    with_compliance(spacing, |arrays| {
        let place = arrays.positions_mm.as_chunks::<3>().0.to_vec();
        let at_end = |vertex: usize| vertex / SIDE == SIDE - 1;
        let image = |[x, y, z]: [f32; 3]| [2.0 * END_MM as f32 - x, y, z];
        let mut values = arrays.compliance_mm_per_n.iter_mut();
        for i in 0..3 * place.len() {
            for k in i..3 * place.len() {
                let value = values.next().expect("an upper triangle");
                match [i % 3, k % 3] {
                    [2, 2] if i == k && at_end(i / 3) => *value *= 2.0,
                    [2, 2] => {
                        let to = image(place[k / 3]);
                        let square = |a: usize| f64::from(place[i / 3][a] - to[a]).powi(2);
                        let away = (0..3).map(square).sum::<f64>().sqrt();
                        *value += (1.0 / (PI * MODULUS_MPA * away)) as f32;
                    }
                    // Along the skin next to nothing, but in the plane nothing at all.
                    [0, 0] if i == k && at_end(i / 3) => {}
                    _ if i == k => *value = 1e-4,
                    _ => {}
                }
            }
        }
        for vertex in (0..place.len()).filter(|vertex| at_end(*vertex)) {
            arrays.areas_mm2[vertex] /= 2.0;
        }
    })
}

/// A half-space that a force along it moves along itself as Cerruti says,
/// `u_i = (1 / r + x_i x_k / r^3) q_k / 4 pi G`, and at a vertex itself the mean over a disc of its area.
/// Normal and tangential forces do not mix, as in what is incompressible.
pub(crate) fn rough_plane() -> Plane {
    let unit = 1.0 / (4.0 * PI * SHEAR_MODULUS_MPA);
    let area_mm2 = (SPACING_PX * PITCH_MM).powi(2);
    let own = unit * 1.5 * 16.0 / (3.0 * PI * (area_mm2 / PI).sqrt());
    with_compliance(PixelSpacing::One, |arrays| {
        let place = arrays.positions_mm.as_chunks::<3>().0.to_vec();
        let mut values = arrays.compliance_mm_per_n.iter_mut();
        for i in 0..3 * place.len() {
            for k in i..3 * place.len() {
                let value = values.next().expect("an upper triangle");
                let ((p, a), (q, b)) = ((i / 3, i % 3), (k / 3, k % 3));
                if a == 2 || b == 2 {
                    continue;
                }
                let d: [f64; 2] = std::array::from_fn(|x| f64::from(place[p][x] - place[q][x]));
                let (r, same) = (d[0].hypot(d[1]), f64::from(u8::from(a == b)));
                let away = || unit * (same / r + d[a] * d[b] / r.powi(3));
                *value = if p == q { own * same } else { away() } as f32;
            }
        }
    })
}

fn with_compliance(spacing: PixelSpacing, change: impl Fn(&mut Arrays)) -> Plane {
    let margin = (MAP_SIDE_PX as f64 - SPACING_PX * (SIDE - 1) as f64) / 2.0;
    let uv = |i: usize| [i % SIDE, i / SIDE].map(|k| margin + SPACING_PX * k as f64);
    let uv_px: Vec<[f32; 2]> = (0..SIDE * SIDE).map(|i| uv(i).map(|c| c as f32)).collect();
    let at = |i: usize| {
        let [x, y] = place_mm(uv(i));
        [x as f32, y as f32, 0.0]
    };
    let positions_mm: Vec<[f32; 3]> = (0..SIDE * SIDE).map(at).collect();
    let mut triangles = Vec::new();
    for row in 0..SIDE - 1 {
        for column in 0..SIDE - 1 {
            let (a, s) = ((row * SIDE + column) as u32, SIDE as u32);
            triangles.extend([[a, a + s + 1, a + 1], [a, a + s, a + s + 1]]);
        }
    }
    let patch = PatchVertices { positions_mm: positions_mm.clone(), uv_px };
    let atlas =
        Atlas::new(PITCH_MM as f32, triangles.clone(), patch.clone(), patch).expect("an atlas");
    let area = (SPACING_PX * PITCH_MM).powi(2) as f32;
    let vertices = positions_mm.len();
    let mut arrays = Arrays::half_space(
        positions_mm.into_flattened(),
        [0.0, 0.0, -1.0].repeat(vertices),
        vec![area; vertices],
        triangles.as_flattened().to_vec(),
        MODULUS_MPA,
    );
    change(&mut arrays);
    let triangles = triangles.len();
    let young_mpa = MODULUS_MPA * (1.0 - POISSON * POISSON);
    let layers = vec![Layer { young_mpa, poisson: POISSON, thickness_mm: 100.0 }];
    let header = Header { vertices, triangles, share_max: 1.0, layers, ..Header::current() };
    let model = Arc::new(ContactModel::new(header, arrays).expect("a model"));
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    let skin = PixelSkin::new(&model, &atlas, Arc::clone(&raster)).expect("layers");
    let skin = Arc::new(skin);
    let settings = Settings { method: Method::SmallStrain, friction: true, ..Settings::default() };
    Plane {
        pixels: PixelContact::new(skin, &model, spacing),
        out: Contact::new(model.vertices()),
        solver: Solver::new(model, settings).expect("a solver"),
        raster,
    }
}

/// Relative L2 against Hertz' pressure `p0 sqrt(1 - r^2 / a^2)` under a ball, on the skin.
pub(crate) fn miss(map_pa: &[f32], radius_mm: f64, at: [f64; 2], depth_mm: f64) -> f64 {
    let a = (radius_mm * depth_mm).sqrt();
    let p0_pa = 2e6 * MODULUS_MPA / std::f64::consts::PI * (depth_mm / radius_mm).sqrt();
    let (mut off, mut size) = (0.0, 0.0);
    for (index, found) in map_pa.iter().enumerate() {
        let pixel = [index % MAP_SIDE_PX, index / MAP_SIDE_PX].map(|k| k as f64 + 0.5);
        let [x, y] = place_mm(pixel);
        if x > END_MM {
            continue;
        }
        let r = (x - at[0]).hypot(y - at[1]);
        let due = p0_pa * (1.0 - (r / a).powi(2)).max(0.0).sqrt();
        off += (f64::from(*found) - due).powi(2);
        size += due * due;
    }
    (off / size).sqrt()
}

pub(crate) fn force_n(out: &Contact) -> f64 {
    out.force_n.map(f64::abs).iter().sum()
}
