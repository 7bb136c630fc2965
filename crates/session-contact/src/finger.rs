//! One finger of a session: its solver, from frame to frame.

use papilla_vector::norm;
use std::{fmt, sync::Arc, time::Instant};

use bytes::BytesMut;
use papilla_contact::{
    Contact, ContactModel, NetForce, Object, Person, PixelContact, Scene, ShearEnergy,
};
use papilla_proto::{
    ErrorCode, Hello, MAP_LEN, MAP_SIDE_PX, PressureRange, Problem, RuntimeEffect, SampleType,
    atlas::Raster,
    contact::{ContactMethod, Input, POSE_LEN, Pose, ROW, SampleLayout, TOUCH_LEN, Touch},
    effects::OutOfRange,
    flags,
};

use papilla_session_state::{Reader, StateError, Writer};

use super::{
    FrameForm, Skin, announced,
    felt::Felt,
    gaps::GapReader,
    method::Chosen,
    solver::{FingerSolver, of_contact},
    unusable,
};

/// A finger.
pub struct Finger {
    form: FrameForm,
    person: Person,
    solver: Option<FingerSolver>,
    /// The method, where rigid objects without friction press.
    plain_method: Option<ContactMethod>,
    /// SHA-256 of the contact model's file.
    model_sha256: Option<Box<str>>,
    /// Answers tell how wrong they are likely to be.
    tells_error: bool,
    out: Contact,
    objects: Vec<Object>,
    /// Samples of a frame, and of what follows them.
    samples: Vec<f32>,
    gaps: Option<GapReader>,
    raster: Arc<Raster>,
    pressure: Option<SampleLayout>,
    has_shear: bool,
    /// How far each vertex has moved, mm; empty if the hello does not ask.
    moved_mm: Vec<[f32; 3]>,
    /// By the effect `shear_energy`.
    shear_energy: Option<ShearEnergy>,
    /// The pressure that is sent, if as a map.
    sent_pa: Vec<f32>,
    touch: Touch,
    /// Nobody knows where things are in this frame.
    is_lost: bool,
}

impl fmt::Debug for Finger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Finger").field("form", &self.form).finish_non_exhaustive()
    }
}

/// A frame of any input but windows of pressure, whose header fits.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// What follows the header.
    pub payload: &'a [u8],
    /// Type of its samples.
    pub sample_type: SampleType,
    /// Unit of scaled samples of pressure, Pa.
    pub scale: f32,
    /// Time by the client's clock.
    pub time_us: u64,
}

/// What a frame came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// Greatest pressure on a finger of reference stiffness, Pa.
    pub peak_pa: f32,
    /// Bits of [`papilla_proto::flags`].
    pub flags: u8,
    /// Linearisations that the solve took; none if nothing was solved.
    pub iterations: Option<u32>,
    /// By what the error of the force is told, where rigid objects without friction press.
    pub felt: Option<Felt>,
}

impl Finger {
    pub(crate) fn new(
        hello: &Hello,
        form: FrameForm,
        skin: Skin<'_>,
        solved: Option<(&Chosen, &Arc<ContactModel>)>,
        objects: Vec<Object>,
        person: Person,
    ) -> Result<Self, Problem> {
        let vertices = skin.atlas.vertex_count();
        let solver =
            solved.map(|(chosen, model)| FingerSolver::new(hello, skin, model, chosen, person));
        let solver = solver.transpose()?;
        let of_map = form.layout == SampleLayout::Map;
        let samples = match form.input {
            Input::Objects => 0,
            Input::Pressure if of_map => 0,
            _ => form.payload_len_max(1),
        };
        let mut out = Contact::new(if form.is_window() { 0 } else { vertices });
        if announced::has_friction(hello) {
            out.shear_pa.resize(vertices, [0.0; 3]);
        }
        let is_plain =
            |object: &Object| object.stiffness_mpa_per_mm.is_infinite() && object.friction <= 0.0;
        let plain_method = solved.map(|(chosen, _)| chosen.method).filter(|_| {
            form.input == Input::Objects
                && !announced::has_friction(hello)
                && objects.iter().all(is_plain)
        });
        let sends_map = hello.pressure == Some(SampleLayout::Map);
        Ok(Self {
            form,
            person,
            solver,
            plain_method,
            model_sha256: skin.model_sha256.map(Into::into),
            tells_error: hello.error_estimate == Some(true),
            out,
            objects,
            samples: vec![0.0; samples],
            gaps: GapReader::new(hello, form, skin),
            raster: Arc::clone(skin.raster),
            pressure: hello.pressure,
            has_shear: hello.shear == Some(true),
            moved_mm: vec![[0.0; 3]; if hello.displacement == Some(true) { vertices } else { 0 }],
            shear_energy: shear_energy(hello, skin)?,
            sent_pa: vec![0.0; if sends_map { MAP_LEN } else { 0 }],
            touch: Touch::default(),
            is_lost: false,
        })
    }

    /// Whether frames are windows of pressure, which the codec reads.
    #[must_use]
    pub fn reads_windows(&self) -> bool {
        self.form.is_window()
    }

    /// SHA-256 of the file of the contact model that finds pressure, if it is from one.
    #[must_use]
    pub fn model_sha256(&self) -> Option<&str> {
        self.model_sha256.as_deref()
    }

    /// Whether answers are to tell how wrong they are likely to be, behind what
    /// [`write`](Self::write) appends.
    #[must_use]
    pub fn tells_error(&self) -> bool {
        self.tells_error
    }

    /// Whether frames are pressure, which a client may have wrong.
    #[must_use]
    pub fn takes_pressure(&self) -> bool {
        self.form.input == Input::Pressure
    }

    /// Adds to SED (224 x 224, J/m3), which a network made of `pressure_pa` (224 x 224), what traction
    /// along the skin changes, if the hello names the effect `shear_energy`. Both are of the finger of
    /// reference stiffness. Traction beyond a range that is to be clamped is felt as its greatest.
    pub fn feel_shear(
        &mut self,
        pressure_pa: &[f32],
        range: PressureRange,
        sed_j_per_m3: &mut [f32],
    ) {
        let part = 1.0 / self.stiffness();
        let limit_pa = match range.beyond {
            OutOfRange::Clamp => range.times(self.stiffness()).trained_max_pa,
            OutOfRange::Refuse | OutOfRange::Flag => f32::INFINITY,
        };
        if let Some(energy) = &mut self.shear_energy {
            energy.add(pressure_pa, &self.out.shear_pa, part, limit_pa, sed_j_per_m3);
        }
    }

    /// Bytes that [`Self::write`] appends.
    #[must_use]
    pub fn sections_len(&self) -> usize {
        let touch = if self.form.input == Input::Pressure { 0 } else { TOUCH_LEN };
        let pressure = self.pressure.map_or(0, |layout| match layout {
            SampleLayout::Map => 4 * self.sent_pa.len(),
            SampleLayout::Vertices => 4 * self.out.pressure_pa.len(),
        });
        let shear = if self.has_shear { 12 * self.out.shear_pa.len() } else { 0 };
        let moved = 12 * self.moved_mm.len();
        [touch + pressure, shear, moved].map(|bytes| bytes.next_multiple_of(16)).iter().sum()
    }

    /// Stiffness of the tissue over that of the reference finger: the network is asked about
    /// pressure over it, and SED grows with it.
    #[must_use]
    pub fn stiffness(&self) -> f32 {
        self.person.stiffness as f32
    }

    /// Whether pressure and traction at vertices that were [taken](Self::take) are ones that the model
    /// of `range` takes.
    ///
    /// # Errors
    /// The first that is not.
    pub fn require_within(&self, range: PressureRange) -> Result<(), Problem> {
        let range = range.times(self.stiffness());
        let (limit_pa, known_pa) = (range.limit_pa(), range.trained_max_pa);
        let refuse = |what: &str, vertex: usize, pa: f64, field: String| {
            let message = format!(
                "the {what} at vertex {vertex} is {pa:e} Pa; the model knows up to {known_pa} Pa on \
                 this finger"
            );
            Err(Problem::new(ErrorCode::OutOfRange, message).at(field))
        };
        if self.touch.pressure_max_pa > limit_pa {
            let pressures = &self.out.pressure_pa;
            let vertex = pressures.iter().position(|p| *p > limit_pa).unwrap_or_default();
            return refuse("pressure", vertex, pressures[vertex].into(), "pressure_pa".to_owned());
        }
        let tractions = self.out.shear_pa.iter().map(|q| size_of(*q));
        match tractions.enumerate().find(|(_, size)| *size > f64::from(limit_pa)) {
            Some((vertex, size)) => {
                refuse("traction", vertex, size, format!("traction_pa[{vertex}]"))
            }
            None => Ok(()),
        }
    }

    /// Greatest traction that SED is to feel, on a finger of reference stiffness, Pa; 0 if the hello
    /// does not name the effect `shear_energy`.
    #[must_use]
    pub fn traction_peak_pa(&self) -> f32 {
        if self.shear_energy.is_none() {
            return 0.0;
        }
        let peak = self.out.shear_pa.iter().map(|q| size_of(*q)).fold(0.0, f64::max);
        (peak / f64::from(self.stiffness())) as f32
    }

    /// Turns a map of the finger of reference stiffness (Pa or J/m3) into this person's.
    pub fn to_person(&self, map: &mut [f32]) {
        scale(map, self.stiffness());
    }

    /// Turns this person's pressure (Pa) into that on the finger of reference stiffness; returns
    /// the factor.
    pub fn to_reference(&self, map_pa: &mut [f32]) -> f32 {
        let part = 1.0 / self.stiffness();
        scale(map_pa, part);
        part
    }

    /// Reads a frame whose header fits, and finds what presses. Pressure on a finger of reference
    /// stiffness goes into `map_pa` (224 x 224, Pa), if there is one.
    ///
    /// # Errors
    /// What cannot be placed, is no depth or no pressure; the finger stays as it was.
    pub fn take(&mut self, frame: Frame<'_>, map_pa: Option<&mut [f32]>) -> Result<Taken, Problem> {
        let Frame { payload, sample_type, scale, time_us } = frame;
        self.is_lost = false;
        let net = match self.form.input {
            Input::Pressure => {
                self.read_samples(payload, sample_type, scale)?;
                self.take_pressure()?;
                return Ok(self.taken(map_pa));
            }
            Input::Objects => self.place(payload)?,
            Input::Gaps => {
                self.read_samples(payload, sample_type, 1.0)?;
                self.read_gaps(time_us)?
            }
        };
        let start = Instant::now();
        let Self { solver: Some(solver), out, objects, gaps, moved_mm, .. } = self else {
            return Err(Problem::new(ErrorCode::Internal, "a finger without a solver"));
        };
        let scene = gaps.as_ref().map_or(Scene::Objects(objects), |g| Scene::Gaps(g.gaps()));
        let travel_mm = solver.solve(scene, net, out).map_err(|error| of_contact(&error))?;
        if let Some(gaps) = gaps {
            gaps.solved(time_us);
        }
        let at_vertices = out.touched().iter().map(|v| out.pressure_pa[*v as usize]);
        let peak = match solver.pixels() {
            Some(pixels) => pixels.peak_pa(),
            None => at_vertices.fold(0.0, f32::max),
        };
        self.touch = Touch {
            force_n: out.force_n.map(|v| v as f32),
            torque_n_mm: out.torque_n_mm.map(|v| v as f32),
            area_mm2: out.area_mm2 as f32,
            centre_mm: out.centre_mm.map(|v| v as f32),
            penetration_mm: out.penetration_mm as f32,
            stiffness_n_per_mm: out.stiffness_n_per_mm.unwrap_or(0.0) as f32,
            travel_mm: travel_mm as f32,
            pressure_max_pa: peak,
            share: out.quality.share,
            solve_us: start.elapsed().as_secs_f32() * 1e6,
        };
        solver.displace(out, moved_mm);
        Ok(self.taken(map_pa))
    }

    /// In place of [`take`](Self::take) where nobody knows where things are: [`write`](Self::write)
    /// tells of no touch, and the solver keeps what the next frame starts from.
    pub fn lose(&mut self) {
        self.is_lost = true;
        self.gaps.iter_mut().for_each(GapReader::lose);
    }

    /// What the pressure at the vertices comes to.
    fn taken(&mut self, map_pa: Option<&mut [f32]>) -> Taken {
        let quality = self.out.quality;
        let peak_pa = self.touch.pressure_max_pa / self.stiffness();
        if let Some(map_pa) = map_pa {
            if peak_pa > 0.0 {
                draw(&self.raster, self.pixels(), &self.out, map_pa);
            } else {
                map_pa.fill(0.0);
            }
            self.to_reference(map_pa);
        }
        let is_solved = self.form.input != Input::Pressure;
        let told = |on: bool, flag: u8| if on && is_solved { flag } else { 0 };
        let flags = told(quality.out_of_range, flags::OUT_OF_RANGE)
            | told(!quality.settled, flags::UNSETTLED)
            | if peak_pa > 0.0 || self.holds_a_body() { 0 } else { flags::NO_CONTACT };
        let iterations = is_solved.then_some(self.out.effort.iterations);
        let felt = self
            .plain_method
            .filter(|_| peak_pa > 0.0)
            .and_then(|method| Felt::of(method, &self.out, self.person));
        Taken { peak_pa, flags, iterations, felt }
    }

    /// Whether the pressure that was found exceeds `share` of its greatest at one of these pixels of
    /// the map (row by row), without drawing the map.
    #[must_use]
    pub fn presses_on(&self, pixels: &[usize], share: f32) -> bool {
        let least_pa = share * self.touch.pressure_max_pa;
        if self.is_lost || self.form.input == Input::Pressure || least_pa <= 0.0 {
            return false;
        }
        let on_map = self.pixels().map(PixelContact::map_pa);
        pixels.iter().any(|&index| match on_map {
            Some(map_pa) => map_pa.get(index).is_some_and(|pa| *pa > least_pa),
            None => {
                let pixel = self.raster.at(index / MAP_SIDE_PX, index % MAP_SIDE_PX);
                pixel.is_some_and(|pixel| pixel.value(&self.out.pressure_pa) > least_pa)
            }
        })
    }

    /// Whether a body in the finger is held on the side from which it came, or lies where nothing was found
    /// to press: it touches, even if no force was found.
    #[must_use]
    pub fn holds_a_body(&self) -> bool {
        let quality = self.out.quality;
        let is_in = quality.is_held || quality.is_missed;
        self.form.input != Input::Pressure && is_in && !self.is_lost
    }

    fn pixels(&self) -> Option<&PixelContact> {
        self.solver.as_ref().and_then(FingerSolver::pixels)
    }

    /// Whether an answer depends on the frames before it.
    #[must_use]
    pub fn has_state(&self) -> bool {
        self.solver.is_some()
    }

    /// Writes what answers depend on of the frames before.
    pub fn save(&self, state: &mut Writer) {
        if let Some(solver) = &self.solver {
            solver.save(state);
        }
        if let Some(gaps) = &self.gaps {
            gaps.save(state);
        }
    }

    /// Goes on from what the same finger of the same hello has [saved](Self::save).
    ///
    /// # Errors
    /// The state is of another finger.
    pub fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        self.solver.as_mut().map_or(Ok(()), |solver| solver.restore(state))?;
        self.gaps.as_mut().map_or(Ok(()), |gaps| gaps.restore(state))
    }

    /// Appends what pushes back, and pressure, shear and displacement if they were asked for, each
    /// up to a multiple of 16.
    pub fn write(&mut self, bytes: &mut BytesMut) {
        if std::mem::take(&mut self.is_lost) {
            bytes.resize(bytes.len() + self.sections_len(), 0);
            return;
        }
        if self.form.input != Input::Pressure {
            bytes.extend_from_slice(&self.touch.encode());
        }
        let Self { raster, out, sent_pa, solver, .. } = self;
        let pressure_pa: &[f32] = match self.pressure {
            None => &[],
            Some(SampleLayout::Vertices) => &out.pressure_pa,
            Some(SampleLayout::Map) => {
                draw(raster, solver.as_ref().and_then(FingerSolver::pixels), out, sent_pa);
                sent_pa
            }
        };
        let shear_pa = if self.has_shear { out.shear_pa.as_flattened() } else { &[] };
        for values in [pressure_pa, shear_pa, self.moved_mm.as_flattened()] {
            for value in values {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            bytes.resize(bytes.len().next_multiple_of(16), 0);
        }
    }

    fn read_samples(
        &mut self,
        payload: &[u8],
        sample_type: SampleType,
        scale: f32,
    ) -> Result<(), Problem> {
        let decoded = sample_type.decode(payload, scale, &mut self.samples);
        decoded
            .map_err(|error| Problem::new(ErrorCode::WrongLength, error.to_string()).at("payload"))
    }

    fn take_pressure(&mut self) -> Result<(), Problem> {
        let mut peak = 0.0f32;
        let (pressures, tractions) = self.samples.split_at(self.out.pressure_pa.len());
        let tractions = tractions.as_chunks::<3>().0;
        if let Some(vertex) = tractions.iter().position(|t| !t.iter().all(|v| v.is_finite())) {
            let message = format!("the traction at vertex {vertex} is {:?} Pa", tractions[vertex]);
            let field = format!("traction_pa[{vertex}]");
            return Err(Problem::new(ErrorCode::NotFinite, message).at(field));
        }
        for (vertex, p) in pressures.iter().enumerate() {
            if !(*p >= 0.0 && p.is_finite()) {
                let code =
                    if p.is_finite() { ErrorCode::NegativePressure } else { ErrorCode::NotFinite };
                let message = format!("the pressure at vertex {vertex} is {p} Pa");
                return Err(Problem::new(code, message).at("pressure_pa"));
            }
            peak = peak.max(*p);
        }
        self.out.pressure_pa.copy_from_slice(pressures);
        self.touch.pressure_max_pa = peak;
        if self.form.has_vectors {
            self.out.shear_pa.copy_from_slice(tractions);
        }
        Ok(())
    }

    /// Puts the objects where the frame says; all of them or none.
    fn place(&mut self, payload: &[u8]) -> Result<Option<NetForce>, Problem> {
        let rows = payload.as_chunks::<POSE_LEN>().0;
        let mut rows = rows.iter().map(|row| Pose::decode(row).unwrap_or_default());
        for pass in [false, true] {
            let poses = rows.clone().zip(&mut self.objects).enumerate();
            for (index, (pose, object)) in poses {
                let at = |member: &str| format!("objects[{index}].{member}");
                let Some(rotation) = pose.rotation() else {
                    let message = format!(
                        "{:?} is no rotation: a quaternion x y z w has length 1",
                        pose.quaternion
                    );
                    return Err(unusable(at("quaternion"), message));
                };
                if !pose.origin_mm.iter().all(|v| v.abs() <= 1e5) {
                    let message = format!("{:?} mm is not within 100 m", pose.origin_mm);
                    return Err(unusable(at("origin_mm"), message));
                }
                if pass {
                    object.placement.rotation = rotation;
                    object.placement.origin_mm = pose.origin_mm.map(f64::from);
                }
            }
        }
        let row = self.form.has_force.then(|| rows.nth(self.objects.len())).flatten();
        row.map_or(Ok(None), |row| {
            let [x, y, z] = row.origin_mm;
            net_force([x, y, z, row.quaternion[0]])
        })
    }

    fn read_gaps(&mut self, time_us: u64) -> Result<Option<NetForce>, Problem> {
        let Self { samples, gaps, form, .. } = self;
        let (samples, row) = samples.split_at(samples.len() - if form.has_force { ROW } else { 0 });
        if let Some(gaps) = gaps {
            gaps.read(samples, time_us)?;
        }
        match row {
            [x, y, z, force, ..] => net_force([*x, *y, *z, *force]),
            _ => Ok(None),
        }
    }
}

/// Size of a vector; that of the greatest f32 is finite.
fn size_of(vector: [f32; 3]) -> f64 {
    vector.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt()
}

/// What feels traction, if the hello asks for it.
fn shear_energy(hello: &Hello, skin: Skin<'_>) -> Result<Option<ShearEnergy>, Problem> {
    let name = RuntimeEffect::ShearEnergy.as_str();
    if !hello.effects.iter().any(|effect| effect == name) {
        return Ok(None);
    }
    let Some(interface) = skin.interface else {
        let message = "this service has no contact model that names layers of the skin; make one \
                       with `fe-datagen contact`, or leave 'shear_energy' out";
        return Err(Problem::new(ErrorCode::BadEffect, message).at(name));
    };
    Ok(Some(ShearEnergy::new(Arc::clone(interface))))
}

/// Draws the pressure that was found, of pixels or else of vertices, as a map, Pa.
fn draw(raster: &Raster, pixels: Option<&PixelContact>, out: &Contact, map_pa: &mut [f32]) {
    match pixels {
        Some(pixels) => map_pa.copy_from_slice(pixels.map_pa()),
        // Both lengths are those of the atlas.
        None => _ = raster.rasterise(&out.pressure_pa, map_pa),
    }
}

/// Multiplies all values, unless by one.
fn scale(values: &mut [f32], factor: f32) {
    if factor.to_bits() != 1.0f32.to_bits() {
        values.iter_mut().for_each(|value| *value *= factor);
    }
}

/// The net force of a row: a direction and its size, N; none of size 0.
fn net_force([x, y, z, force_n]: [f32; 4]) -> Result<Option<NetForce>, Problem> {
    if force_n == 0.0 {
        return Ok(None);
    }
    if !(force_n > 0.0 && force_n.is_finite()) {
        return Err(unusable("force_n", format!("{force_n} N is no net force; 0 asks for none")));
    }
    let direction = [x, y, z].map(f64::from);
    let size = norm(direction);
    if !((size - 1.0).abs() < 1e-3) {
        return Err(unusable("direction", format!("a unit vector is due; this has length {size}")));
    }
    let direction = direction.map(|v| v / size);
    Ok(Some(NetForce { direction, force_n: f64::from(force_n) }))
}
