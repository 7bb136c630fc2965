use super::*;
use crate::{Arrays, Header, Layer};
use papilla_atlas::PatchVertices;

const SIDE_VERTICES: usize = 23;
const MIDDLE: usize = 112 * 224 + 112;

/// A plane skin, 0.1 mm a pixel, of vertices a millimetre apart.
fn plane(layers: &[Layer]) -> Option<ShearEnergy> {
    let at = |i: usize| [i % SIDE_VERTICES, i / SIDE_VERTICES].map(|k| 10.0 * k as f32 + 2.0);
    let uv_px: Vec<[f32; 2]> = (0..SIDE_VERTICES * SIDE_VERTICES).map(at).collect();
    let mut triangles = Vec::new();
    for y in 0..SIDE_VERTICES - 1 {
        for x in 0..SIDE_VERTICES - 1 {
            let (a, s) = ((y * SIDE_VERTICES + x) as u32, SIDE_VERTICES as u32);
            triangles.extend([[a, a + s, a + 1], [a + 1, a + s, a + s + 1]]);
        }
    }
    let positions_mm: Vec<[f32; 3]> = uv_px.iter().map(|[u, v]| [0.1 * v, -0.1 * u, 0.0]).collect();
    let patch = PatchVertices { positions_mm: positions_mm.clone(), uv_px };
    let atlas = Atlas::new(0.1, triangles.clone(), patch.clone(), patch).unwrap();
    let count = positions_mm.len();
    let header = Header {
        vertices: count,
        triangles: triangles.len(),
        share_max: 1.0,
        layers: layers.to_vec(),
        atlas_hash: atlas.hash().to_owned(),
        ..Header::current()
    };
    let arrays = Arrays::half_space(
        positions_mm.into_flattened(),
        (0..count).flat_map(|_| [0.0, 0.0, -1.0]).collect(),
        vec![1.0; count],
        triangles.into_flattened(),
        0.2,
    );
    let model = ContactModel::new(header, arrays).unwrap();
    let skin = Arc::new(Raster::new(&atlas, Patch::Skin));
    let skin = InterfaceSkin::new(&model, &atlas, skin)?;
    Some(ShearEnergy::new(Arc::new(skin)))
}

fn layers() -> [Layer; 3] {
    [(0.136, 0.2), (0.08, 1.0), (0.034, 1.0)].map(|(young_mpa, thickness_mm)| Layer {
        young_mpa,
        poisson: 0.48,
        thickness_mm,
    })
}

/// Traction over a disc in the middle, by vertex.
fn disc(radius_mm: f32, q: [f32; 3]) -> Vec<[f32; 3]> {
    let middle = (SIDE_VERTICES / 2) as f32;
    let at = |i: usize| {
        let [x, y] = [i % SIDE_VERTICES, i / SIDE_VERTICES].map(|k| k as f32 - middle);
        if x.hypot(y) <= radius_mm { q } else { [0.0; 3] }
    };
    (0..SIDE_VERTICES * SIDE_VERTICES).map(at).collect()
}

/// Traction everywhere shears each layer by itself: `q^2 / 2 mu`, whatever lies above.
#[test]
fn traction_everywhere_is_simple_shear() {
    let mut energy = plane(&layers()).unwrap();
    let mu_pa = 0.08e6 / (2.0 * 1.48);
    for q in [[900.0, 0.0, 0.0], [0.0, -900.0, 0.0]] {
        let mut sed = vec![1.0; MAP_LEN];
        energy.add(&vec![0.0; MAP_LEN], &disc(99.0, q), 1.0, f32::INFINITY, &mut sed);
        let (found, due) = (sed[MIDDLE] - 1.0, 900.0 * 900.0 / (2.0 * mu_pa));
        assert!((found / due - 1.0).abs() < 0.03, "{q:?}: {found} for {due}");
    }
}

/// Traction along the normal is none along the skin, and without traction no bit changes.
#[test]
fn what_does_not_shear_adds_nothing() {
    let mut energy = plane(&layers()).unwrap();
    let pressure = vec![5e3; MAP_LEN];
    let mut sed = vec![3.0; MAP_LEN];
    energy.add(&pressure, &disc(3.0, [0.0; 3]), 1.0, f32::INFINITY, &mut sed);
    energy.add(&pressure, &disc(3.0, [0.0, 0.0, 700.0]), 1.0, f32::INFINITY, &mut sed);
    assert!(sed.iter().all(|v| v.to_bits() == 3f32.to_bits()));
}

/// A map that is turned by a quarter with its traction.
#[test]
fn the_way_of_traction_turns_the_map() {
    let mut energy = plane(&layers()).unwrap();
    let mut pressure = vec![0.0; MAP_LEN];
    for (i, p) in pressure.iter_mut().enumerate() {
        let [row, column] = [i / 224, i % 224].map(|k| k as f32 - 111.5);
        *p = (8e3 - 4.0 * (row * row + column * column)).max(0.0);
    }
    // Columns run along -y, rows along x.
    let [along, down] = [[0.0, -600.0, 0.0], [600.0, 0.0, 0.0]].map(|q| {
        let mut sed = vec![200.0; MAP_LEN];
        energy.add(&pressure, &disc(4.0, q), 1.0, f32::INFINITY, &mut sed);
        sed
    });
    let change = |sed: &[f32], i: usize| sed[i] - 200.0;
    let most = (0..MAP_LEN).map(|i| change(&along, i).abs()).fold(0.0, f32::max);
    assert!(most > 1.0, "{most}");
    // Triangles lean one way, so turning is not exact.
    let miss = (0..MAP_LEN)
        .map(|i| (change(&along, i) - change(&down, (i % 224) * 224 + i / 224)).abs())
        .fold(0.0, f32::max);
    assert!(miss < 0.02 * most, "{miss} of {most}");
    // Pressure and traction that point the same way on one side do not on the other.
    let sides = [100, 124].map(|column| change(&along, 112 * 224 + column));
    assert!(sides[0] * sides[1] < 0.0 || (sides[0] / sides[1] - 1.0).abs() > 0.1, "{sides:?}");
}

/// Twice as stiff a person: twice the pressure and traction, SED of the reference finger the same.
#[test]
fn a_stiffer_finger_is_told_by_its_factor() {
    let mut energy = plane(&layers()).unwrap();
    let pressure = vec![2e3; MAP_LEN];
    let [one, two] = [(500.0, 1.0), (1000.0, 0.5)].map(|(q, to_reference)| {
        let mut sed = vec![10.0; MAP_LEN];
        energy.add(&pressure, &disc(3.0, [q, 0.0, 0.0]), to_reference, f32::INFINITY, &mut sed);
        sed
    });
    assert_eq!(one, two);
}

#[test]
fn traction_beyond_a_limit_is_felt_as_the_limit_and_what_is_no_number_is_not_hidden() {
    let mut energy = plane(&layers()).unwrap();
    let pressure = vec![2e3; MAP_LEN];
    let mut felt = |q: [f32; 3], limit_pa: f32| {
        let mut sed = vec![10.0; MAP_LEN];
        energy.add(&pressure, &disc(3.0, q), 1.0, limit_pa, &mut sed);
        sed
    };
    let due = felt([600.0, 800.0, 0.0], f32::INFINITY);
    for limit_pa in [1000.0, 1001.0] {
        assert_eq!(felt([600.0, 800.0, 0.0], limit_pa), due);
    }
    for q in [[6e3, 8e3, 0.0], [1.8e38, 2.4e38, 0.0]] {
        let found = felt(q, 1000.0);
        let miss = found.iter().zip(&due).map(|(a, b)| (a - b).abs() / b.max(1.0));
        assert!(miss.fold(0.0, f32::max) < 1e-3, "{q:?}");
    }
    // Beyond what f32 can square.
    assert!(felt([3e38, 3e38, 0.0], f32::INFINITY).iter().any(|sed| !sed.is_finite()));
}

#[test]
fn a_skin_of_one_layer_has_no_interface() {
    assert!(plane(&layers()[..1]).is_none());
}
