//! Contact as the scripts expect it: of `proto/conformance-contact.json` the skin of the shipped finger
//! on a half-space, so that no FE is needed to make the model; of `proto/conformance.json` the contact
//! model that ships.

use std::{path::Path, sync::Arc};

use papilla_contact::{
    Arrays, Contact, ContactModel, Gaps, Header, Layer, Method, NetForce, Object, Person,
    PixelContact, PixelSkin, PixelSpacing, Scene, Settings, Solver,
};
use papilla_proto::{
    Hello,
    atlas::{Atlas, Patch, Raster},
    contact::{AnnouncedFinger, AnnouncedObject, ContactMethod, Input, Pose},
    sdf::Placement,
};
use serde_json::{Value, json};

use super::{ConformanceError, engines, member, pair, read};

/// Modulus of the half-space, E / (1 - nu^2), MPa.
const MODULUS_MPA: f64 = 0.1;

/// Thickness of the layers of the skin, mm: alike and deep, they are a half-space. Pixels need layers.
const LAYERS_MM: [f64; 2] = [0.2, 98.8];

/// Time between two frames that velocities are taken over, s. A client's frames come whenever they
/// do: the script's things move so fast that all skin slips, whatever the time.
const PASSED_S: f32 = 0.01;

/// What a touch may be off: share of the value, and beside it, in its unit. In the order of the wire.
const TOLERANCES: [(f64, f64); 15] = [
    (0.02, 2e-3),
    (0.02, 2e-3),
    (0.02, 2e-3),
    (0.02, 2e-2),
    (0.02, 2e-2),
    (0.02, 2e-2),
    (0.1, 0.2),
    (0.0, 0.05),
    (0.0, 0.05),
    (0.0, 0.05),
    (0.0, 5e-3),
    (0.1, 1e-3),
    (0.0, 0.02),
    (0.05, 10.0),
    (0.0, 1e-2),
];

/// The finger and, in a case, its solvers.
pub struct ContactRecorder {
    atlas: Atlas,
    file: Vec<u8>,
    model: Arc<ContactModel>,
    pixels: Arc<PixelSkin>,
    sha256: String,
}

/// The fingers of a case.
pub(super) struct Hand {
    objects: Vec<AnnouncedObject>,
    has_force: bool,
    /// Of each finger, where the method is on pixels.
    pixels: Vec<PixelContact>,
    /// Of gaps.
    friction: f64,
    /// Whether a frame of gaps was solved: things move from it on.
    has_frame: bool,
    solvers: Vec<Solver>,
    /// Size of the force (N) and centre of pressure (mm) of each finger's last frame.
    felt: Vec<(f64, [f64; 3])>,
}

/// What contact on pixels found of a finger.
pub(super) struct Pressed<'a> {
    pub(super) map_pa: &'a [f32],
    /// Size of the force.
    pub(super) force_n: f64,
    /// Centre of pressure.
    pub(super) centre_mm: [f64; 3],
}

impl Hand {
    /// The last frame of a finger; none if the method is not on pixels.
    pub(super) fn pressed(&self, finger: usize) -> Option<Pressed<'_>> {
        let (map_pa, (force_n, centre_mm)) =
            (self.pixels.get(finger)?.map_pa(), *self.felt.get(finger)?);
        Some(Pressed { map_pa, force_n, centre_mm })
    }
}

impl ContactRecorder {
    /// The half-space of the atlas in the folder of models.
    ///
    /// # Errors
    /// The atlas is missing or damaged.
    pub fn new(folder: &Path) -> Result<Self, ConformanceError> {
        let atlas = atlas(folder)?;
        let skin = &atlas.patch(Patch::Skin).positions_mm;
        let (normals, areas) = normals_and_areas(skin, atlas.triangles());
        let header = Header {
            software: "conformance-record".to_owned(),
            atlas_hash: atlas.hash().to_owned(),
            vertices: skin.len(),
            triangles: atlas.triangles().len(),
            share_max: 1.0,
            depth_max_mm: 2.0,
            layers: LAYERS_MM.map(layer).to_vec(),
            ..Header::current()
        };
        let triangles = atlas.triangles().as_flattened().to_vec();
        let positions = skin.as_flattened().to_vec();
        let arrays = Arrays::half_space(positions, normals, areas, triangles, MODULUS_MPA);
        Self::of(atlas, arrays.to_bytes(&header)?)
    }

    /// The contact model in the folder of models.
    ///
    /// # Errors
    /// The atlas or the contact model is missing or damaged.
    pub(super) fn shipped(folder: &Path) -> Result<Self, ConformanceError> {
        Self::of(atlas(folder)?, read(folder.join("finger.contact"))?)
    }

    fn of(atlas: Atlas, file: Vec<u8>) -> Result<Self, ConformanceError> {
        // As the service reads it.
        let model = Arc::new(ContactModel::read(&file)?);
        let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
        let pixels = PixelSkin::new(&model, &atlas, raster).ok_or(ConformanceError::Layers)?;
        let sha256 = papilla_dataset::sha256_hex(&file);
        Ok(Self { atlas, file, model, pixels: Arc::new(pixels), sha256 })
    }

    /// The contact model that the service is to be started with.
    #[must_use]
    pub fn file(&self) -> &[u8] {
        &self.file
    }

    /// SHA-256 of that file.
    pub(super) fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Writes what is expected into every step.
    ///
    /// # Errors
    /// A step is not of the format; it says which.
    pub fn fill(&self, file: &mut Value) -> Result<(), ConformanceError> {
        file["atlas_hash"] = json!(self.atlas.hash());
        for case in file["cases"].as_array_mut().into_iter().flatten() {
            let name = case["name"].as_str().unwrap_or_default().to_owned();
            let mut hand = None;
            for (number, step) in case["steps"].as_array_mut().into_iter().flatten().enumerate() {
                self.step(step, &mut hand).map_err(|reason| ConformanceError::Step {
                    case: name.clone(),
                    step: number,
                    reason,
                })?;
            }
        }
        Ok(())
    }

    /// Writes what is expected into one step.
    pub(super) fn step(&self, step: &mut Value, hand: &mut Option<Hand>) -> Result<(), String> {
        let refused = step["expect"]["status"].as_str().is_some_and(|status| status != "ok");
        match step["do"].as_str() {
            Some(_) if refused => {}
            Some("hello") => {
                let hello: Hello = member(step, "hello")?;
                // What the script asks of ready stays; how pressure is found is written.
                if hello.input.is_some_and(|input| input != Input::Pressure) {
                    let method = method(&hello);
                    step["expect"]["ready"]["method"] = json!(method);
                }
                *hand = Some(self.hand(hello)?);
            }
            Some("touch" | "gaps") => {
                let hand = hand.as_mut().ok_or("a touch without a hello")?;
                let (touch, pressure_pa) = self.touch(step, hand)?;
                let pairs: Vec<Value> = touch.iter().zip(TOLERANCES).map(pair).collect();
                step["expect"]["touch"] = json!(pairs);
                if step["expect"].get("pressure_sum").is_some() {
                    let sum: f64 = pressure_pa.iter().map(|p| f64::from(*p)).sum();
                    step["expect"]["pressure_sum"] = pair((&sum, (0.02, 10.0)));
                }
                let is_lost = step["do"] == "touch" && step["poses"].is_null();
                let flags = match (touch[13] > 0.0, is_lost) {
                    (true, _) => json!([]),
                    (false, false) => json!(["no_contact"]),
                    (false, true) => json!(["no_contact", "not_tracked"]),
                };
                step["expect"]["flags"] = flags;
                if let Some(world) = member(step, "world")? {
                    let poses: Vec<[f64; 7]> = member(step, "poses")?;
                    step["engines"] = engines::inputs(world, &poses);
                    step["expect"]["engines"] = engines::felt(world, &touch, &TOLERANCES);
                }
            }
            other => return Err(format!("there is no step '{other:?}'")),
        }
        Ok(())
    }

    fn hand(&self, hello: Hello) -> Result<Hand, String> {
        let has_friction = hello.shear == Some(true)
            || hello.friction.is_some()
            || hello.objects.iter().flatten().any(|o| o.friction.is_some());
        let method = method(&hello);
        let spacing = match method {
            ContactMethod::Pixels => Some(PixelSpacing::One),
            ContactMethod::CoarsePixels => Some(PixelSpacing::Two),
            ContactMethod::Springs | ContactMethod::SmallStrain | ContactMethod::SecondOrder => {
                None
            }
        };
        let fingers = hello.fingers.unwrap_or_else(|| vec![AnnouncedFinger::default()]);
        let solver = |finger: &AnnouncedFinger| {
            let settings = Settings {
                method: match method {
                    ContactMethod::Springs => Method::Springs,
                    ContactMethod::SmallStrain => Method::SmallStrain,
                    ContactMethod::SecondOrder
                    | ContactMethod::Pixels
                    | ContactMethod::CoarsePixels => Method::SecondOrder,
                },
                person: Person { width: finger.width, stiffness: finger.stiffness },
                stiffness: hello.stiffness == Some(true),
                friction: has_friction,
            };
            Solver::new(Arc::clone(&self.model), settings).map_err(|error| error.to_string())
        };
        let solvers = fingers.iter().map(solver).collect::<Result<_, _>>()?;
        let on_pixels = |spacing| PixelContact::new(Arc::clone(&self.pixels), &self.model, spacing);
        let pixels = spacing.map(|spacing| fingers.iter().map(|_| on_pixels(spacing)).collect());
        Ok(Hand {
            objects: hello.objects.unwrap_or_default(),
            has_force: hello.force_target == Some(true),
            pixels: pixels.unwrap_or_default(),
            friction: hello.friction.unwrap_or(0.0),
            has_frame: false,
            felt: vec![(0.0, [0.0; 3]); fingers.len()],
            solvers,
        })
    }

    /// The numbers of a touch and the pressure at the vertices.
    fn touch(&self, step: &Value, hand: &mut Hand) -> Result<([f64; 15], Vec<f32>), String> {
        let finger: Option<usize> = member(step, "finger")?;
        let finger = finger.unwrap_or(0);
        let solver = hand.solvers.get_mut(finger).ok_or("no such finger")?;
        let net: Option<[f64; 4]> = member(step, "net")?;
        if net.is_some() != hand.has_force {
            return Err("'net' is due where the hello has force_target, and there alone".to_owned());
        }
        let mut out = Contact::new(self.model.vertices());
        if step["do"] == "touch" && step["poses"].is_null() {
            // Not tracked: nothing is solved, and solvers keep what they have.
            return Ok(([0.0; 15], out.pressure_pa));
        }
        let (mut objects, mut depth_mm, mut moved_mm) = (Vec::new(), Vec::new(), Vec::new());
        let scene = if step["do"] == "gaps" {
            let sphere: [f64; 4] = member(step, "sphere")?;
            depth_mm.extend(
                self.atlas.patch(Patch::Skin).positions_mm.iter().map(|p| depth(*p, sphere)),
            );
            let velocity: Option<[f32; 3]> = member(step, "velocity")?;
            let passed_s = if hand.has_frame { PASSED_S } else { 0.0 };
            moved_mm.extend(
                velocity.iter().flat_map(|v| vec![v.map(|v| v * passed_s); depth_mm.len()]),
            );
            hand.has_frame = true;
            let friction = hand.friction;
            Scene::Gaps(Gaps { friction, moved_mm: &moved_mm, ..Gaps::rigid(&depth_mm) })
        } else {
            let poses: Vec<[f32; 7]> = member(step, "poses")?;
            for (pose, object) in poses.iter().zip(&hand.objects) {
                objects.push(placed(*pose, object)?);
            }
            Scene::Objects(&objects)
        };
        let net = net.map(|[x, y, z, force_n]| NetForce { direction: [x, y, z], force_n });
        let pixels = hand.pixels.get_mut(finger);
        let solved = match (net, pixels) {
            (Some(net), Some(pixels)) => {
                solver.solve_for_force_on_pixels(&objects, net, pixels, &mut out)
            }
            (None, Some(pixels)) => {
                solver.solve_on_pixels(&objects, pixels, &mut out).map(|()| 0.0)
            }
            (Some(net), None) => solver.solve_for_force(scene, net, &mut out),
            (None, None) => solver.solve(scene, &mut out).map(|()| 0.0),
        };
        let travel_mm = solved.map_err(|error| error.to_string())?;
        let ([fx, fy, fz], [tx, ty, tz], [cx, cy, cz]) =
            (out.force_n, out.torque_n_mm, out.centre_mm);
        hand.felt[finger] = (fx.hypot(fy).hypot(fz), out.centre_mm);
        let at_vertices = || out.pressure_pa.iter().copied().fold(0.0, f32::max);
        let most = hand.pixels.get(finger).map_or_else(at_vertices, PixelContact::peak_pa);
        let stiffness = out.stiffness_n_per_mm.unwrap_or(0.0);
        let (area, left) = (out.area_mm2, out.penetration_mm);
        let share = f64::from(out.quality.share);
        let numbers = [
            fx,
            fy,
            fz,
            tx,
            ty,
            tz,
            area,
            cx,
            cy,
            cz,
            left,
            stiffness,
            travel_mm,
            most.into(),
            share,
        ];
        Ok((numbers, out.pressure_pa))
    }
}

fn atlas(folder: &Path) -> Result<Atlas, ConformanceError> {
    let text = String::from_utf8_lossy(&read(folder.join("atlas.json"))?).into_owned();
    Ok(Atlas::from_json(&text)?)
}

/// The method that a session of this hello has: the one that it names, or else pixels where they can
/// serve it.
fn method(hello: &Hello) -> ContactMethod {
    hello.method.unwrap_or(match hello.input {
        Some(Input::Objects) => ContactMethod::Pixels,
        _ => ContactMethod::SecondOrder,
    })
}

/// A layer of a skin that is the half-space.
fn layer(thickness_mm: f64) -> Layer {
    Layer { young_mpa: 0.75 * MODULUS_MPA, poisson: 0.5 - 1e-6, thickness_mm }
}

/// How deep a place of the skin lies in a ball (x, y, z, radius), in f64 and rounded to f32.
#[must_use]
pub fn depth(at_mm: [f32; 3], [x, y, z, radius]: [f64; 4]) -> f32 {
    let [p, q, r] = at_mm.map(f64::from);
    (radius - ((p - x).powi(2) + (q - y).powi(2) + (r - z).powi(2)).sqrt()) as f32
}

fn placed([x, y, z, a, b, c, d]: [f32; 7], object: &AnnouncedObject) -> Result<Object, String> {
    let pose = Pose { origin_mm: [x, y, z], quaternion: [a, b, c, d] };
    let rotation = pose.rotation().ok_or("a pose that is no rotation")?;
    let shape = object.shape.build("objects").map_err(|error| error.to_string())?;
    let placement = Placement { rotation, origin_mm: pose.origin_mm.map(f64::from) };
    let stiffness_mpa_per_mm = object.stiffness_mpa_per_mm.unwrap_or(f64::INFINITY);
    let friction = object.friction.unwrap_or(0.0);
    Ok(Object { shape, placement, stiffness_mpa_per_mm, friction })
}

/// Outward normals and areas of the vertices of a surface, each triangle in thirds.
fn normals_and_areas(places: &[[f32; 3]], triangles: &[[u32; 3]]) -> (Vec<f32>, Vec<f32>) {
    let mut sums = vec![[0.0f64; 3]; places.len()];
    let mut areas = vec![0.0f64; places.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| places[corner as usize].map(f64::from));
        let side = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - a[i]) };
        let (u, v) = (side(b), side(c));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let third = n.iter().map(|c| c * c).sum::<f64>().sqrt() / 6.0;
        for corner in corners {
            areas[*corner as usize] += third;
            for (sum, n) in sums[*corner as usize].iter_mut().zip(n) {
                *sum += n;
            }
        }
    }
    let unit = |v: &[f64; 3]| {
        let size = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        v.map(|c| (c / size) as f32)
    };
    (sums.iter().flat_map(unit).collect(), areas.iter().map(|a| *a as f32).collect())
}
