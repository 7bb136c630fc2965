//! The answer to a frame: its status, its map and the other sections that the hello asked for.

use papilla_proto::{
    ErrorEstimate, FrameHeader, FrameStatus, MAP_LEN, Problem, Ready, SampleType, Summary, Window,
    contact::Touch,
    effects::{RATES_HEAD_LEN, SectionName},
    flags,
    spikes::Fired,
};

use crate::PapillaError;

/// What became of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// It was rendered.
    Ok,
    /// A newer frame took its place.
    Superseded {
        /// Before it left this client.
        by_client: bool,
    },
    /// Its deadline passed.
    Late,
    /// It was old when it arrived.
    Stale,
    /// The service refused it; the session goes on.
    Error(Problem),
    /// The connection broke before its answer.
    Lost,
}

/// The outcome of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Number of the frame, as [`Session::send`](crate::Session::send) gave it.
    pub sequence: u32,
    /// What became of it; everything below `client_time_us` is of rendered frames.
    pub status: Status,
    /// The frame's time by the client's clock, us.
    pub client_time_us: u64,
    /// A pressure is above what the tier was trained on: the map is of less, or an extrapolation.
    pub out_of_range: bool,
    /// The map is zero; no network was asked.
    pub no_contact: bool,
    /// Rougher or heavier than any map the tier was trained on: it may mean nothing.
    pub unfamiliar: bool,
    /// The contact reaches the edge of the atlas; what lies beyond is missing.
    pub cut_off: bool,
    /// The contact solve did not settle: the answer is rough.
    pub unsettled: bool,
    /// To [`Session::send_not_tracked`](crate::Session::send_not_tracked): all is zero.
    pub not_tracked: bool,
    /// The client's clock ticks so coarsely, stands, or counts ms or ns, so that rates and spikes may be far
    /// off.
    pub coarse_clock: bool,
    /// Number of the finger.
    pub finger: u8,
    /// Name of the tier that rendered.
    pub tier: String,
    /// Time in the server, us.
    pub total_us: u32,
    /// Of which waiting for a thread.
    pub queue_us: u32,
    /// Of which in the network.
    pub infer_us: u32,
    /// The pixels of `map` that the answer carried; all others are 0.
    pub window: Window,
    /// SED, J/m3: the whole map, 224 x 224, row-major; empty if the session asked for none.
    pub map: Vec<f32>,
    /// How wrong this answer is likely to be, by what it shows; what is not stated is infinite.
    pub error_estimate: ErrorEstimate,
    /// What pushes back, of objects and gaps.
    pub touch: Option<Touch>,
    /// The pressure that was found, Pa, if asked for.
    pub pressure_pa: Vec<f32>,
    /// Traction along the skin at each vertex, Pa, in the finger's frame, if asked for.
    pub shear_pa: Vec<[f32; 3]>,
    /// How far each vertex of the skin has moved, mm, in the finger's frame, if asked for.
    pub displacement_mm: Vec<[f32; 3]>,
    /// SED at the vertices, J/m3, if asked for in place of the map.
    pub vertices: Vec<f32>,
    /// Firing rates of SA1 afferents, Hz, a whole map or at the vertices: the effect `afferents`;
    /// [`rates_hz`](Self::rates_hz) says why there are none.
    pub rates: Vec<f32>,
    /// The effect `summary`.
    pub summary: Option<Summary>,
    /// The effect `points`: SED there, J/m3.
    pub points: Vec<f32>,
    /// Firing rates there, Hz: with the effect `afferents` too.
    pub point_rates_hz: Vec<f32>,
    /// The effect `actuators`.
    pub actuators: Vec<f32>,
    /// The effect `spikes`.
    pub fired: Option<Fired>,
}

impl Answer {
    /// Whether there is a map (or what the session asked for in its place).
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.status == Status::Ok
    }

    /// The greatest value of the map; 0 without one.
    #[must_use]
    pub fn max(&self) -> f32 {
        self.map.iter().copied().fold(0.0, f32::max)
    }

    /// SED, J/m3: the whole map, or the values at the vertices if the session asked for those.
    ///
    /// # Errors
    /// [`PapillaError::NotCarried`] where the session asked for neither, or the frame was not rendered.
    pub fn sed(&self) -> Result<&[f32], PapillaError> {
        let found = if self.map.is_empty() { &self.vertices } else { &self.map };
        self.carried("sed", found, "leave 'map' true in the hello")
    }

    /// Firing rates of SA1 afferents, Hz, where [`sed`](Self::sed) is.
    ///
    /// # Errors
    /// [`PapillaError::NotCarried`] where the session has no such map, or the frame was not rendered.
    pub fn rates_hz(&self) -> Result<&[f32], PapillaError> {
        let advice = "name the effect 'afferents' in the hello, and leave 'map' true";
        self.carried("rates_hz", &self.rates, advice)
    }

    fn carried<'a>(
        &self,
        member: &'static str,
        found: &'a [f32],
        advice: &'static str,
    ) -> Result<&'a [f32], PapillaError> {
        if !found.is_empty() {
            return Ok(found);
        }
        let advice = if self.is_ok() { advice } else { "the frame was not rendered" };
        Err(PapillaError::NotCarried { member, advice })
    }

    pub(crate) fn without_map(sequence: u32, client_time_us: u64, status: Status) -> Self {
        Self {
            sequence,
            status,
            client_time_us,
            out_of_range: false,
            no_contact: false,
            unfamiliar: false,
            cut_off: false,
            unsettled: false,
            not_tracked: false,
            coarse_clock: false,
            finger: 0,
            tier: String::new(),
            total_us: 0,
            queue_us: 0,
            infer_us: 0,
            window: Window::EMPTY,
            map: Vec::new(),
            error_estimate: ErrorEstimate::default(),
            touch: None,
            pressure_pa: Vec::new(),
            shear_pa: Vec::new(),
            displacement_mm: Vec::new(),
            vertices: Vec::new(),
            rates: Vec::new(),
            summary: None,
            points: Vec::new(),
            point_rates_hz: Vec::new(),
            actuators: Vec::new(),
            fired: None,
        }
    }

    /// Reads a binary message in a session on the terms of `ready`.
    pub(crate) fn read(
        header: &FrameHeader,
        message: &[u8],
        ready: &Ready,
        tier: String,
    ) -> Result<Self, PapillaError> {
        let &FrameHeader { queue_us, infer_us, flags: bits, finger, .. } = header;
        let status = match header.status {
            FrameStatus::Ok => Status::Ok,
            FrameStatus::Superseded => Status::Superseded { by_client: false },
            FrameStatus::Late => Status::Late,
            FrameStatus::Stale => Status::Stale,
            FrameStatus::Error => {
                return Err(PapillaError::Protocol("an error came as a frame".to_owned()));
            }
        };
        let mut answer = Self {
            out_of_range: bits & flags::OUT_OF_RANGE != 0,
            no_contact: bits & flags::NO_CONTACT != 0,
            unfamiliar: bits & flags::UNFAMILIAR != 0,
            cut_off: bits & flags::CUT_OFF != 0,
            unsettled: bits & flags::UNSETTLED != 0,
            not_tracked: bits & flags::NOT_TRACKED != 0,
            coarse_clock: bits & flags::COARSE_CLOCK != 0,
            finger,
            tier,
            total_us: header.time_us,
            queue_us,
            infer_us,
            window: header.window(),
            ..Self::without_map(header.sequence, header.client_time_us, status)
        };
        if answer.is_ok() {
            answer.read_sections(header, message, ready)?;
        }
        Ok(answer)
    }

    fn read_sections(
        &mut self,
        header: &FrameHeader,
        message: &[u8],
        ready: &Ready,
    ) -> Result<(), PapillaError> {
        for section in &ready.sections {
            let bytes = match section.name {
                // Its window may differ from answer to answer.
                SectionName::Map => header.payload_len(),
                _ => section.bytes as usize,
            };
            let at = section.offset as usize;
            let short = || PapillaError::Protocol(format!("an answer ends in {:?}", section.name));
            let part = message.get(at..at + bytes).ok_or_else(short)?;
            match section.name {
                SectionName::Touch => self.touch = Touch::decode(part),
                SectionName::Pressure => self.pressure_pa = floats(part)?,
                SectionName::Shear => {
                    self.shear_pa = floats(part)?.as_chunks::<3>().0.to_vec();
                }
                SectionName::Displacement => {
                    self.displacement_mm = floats(part)?.as_chunks::<3>().0.to_vec();
                }
                SectionName::ErrorEstimate => {
                    self.error_estimate = ErrorEstimate::decode(part).ok_or_else(short)?;
                }
                SectionName::Vertices => {
                    self.vertices = vec![0.0; part.len() / header.sample_type.bytes()];
                    header
                        .sample_type
                        .decode(part, header.scale, &mut self.vertices)
                        .map_err(|error| PapillaError::Protocol(error.to_string()))?;
                }
                SectionName::Summary => self.summary = Summary::decode(part),
                SectionName::Rates => {
                    let (head, part) = part.split_at_checked(RATES_HEAD_LEN).ok_or_else(short)?;
                    let scale = head.first_chunk().map_or(1.0, |b| f32::from_le_bytes(*b));
                    self.rates = vec![0.0; part.len() / header.sample_type.bytes()];
                    header
                        .sample_type
                        .decode(part, scale, &mut self.rates)
                        .map_err(|error| PapillaError::Protocol(error.to_string()))?;
                }
                SectionName::Points => self.points = floats(part)?,
                SectionName::PointRates => self.point_rates_hz = floats(part)?,
                SectionName::Actuators => self.actuators = floats(part)?,
                SectionName::Spikes => {
                    let fired = Fired::decode(part, header.client_time_us);
                    self.fired = Some(fired.ok_or_else(short)?);
                }
                SectionName::Map => {
                    self.map = vec![0.0; MAP_LEN];
                    self.window
                        .decode(header.sample_type, part, header.scale, &mut self.map)
                        .map_err(|error| PapillaError::Protocol(error.to_string()))?;
                }
            }
        }
        Ok(())
    }
}

fn floats(bytes: &[u8]) -> Result<Vec<f32>, PapillaError> {
    let mut values = vec![0.0; bytes.len() / 4];
    SampleType::F32
        .decode(bytes, 1.0, &mut values)
        .map_err(|error| PapillaError::Protocol(error.to_string()))?;
    Ok(values)
}

#[cfg(test)]
mod tests {
    use papilla_proto::{HEADER_LEN, spikes::Spike};
    use serde_json::{from_value, json};

    use super::*;

    fn ready(section: &str, bytes: usize) -> Ready {
        from_value(json!({
            "version": 3, "session": 1, "tier": "nano", "effects": [], "atlas_hash": "",
            "predicted_latency_us": 1, "width": 224, "height": 224, "sample_type": "f32",
            "pressure_max_pa": 1e4, "sed_scale_j_per_m3": 1.0, "tier_number": 0,
            "answer_sample_type": "f32", "session_effects": [], "vertices": 2, "fingers": 1,
            "sections": [{"name": section, "offset": HEADER_LEN, "bytes": bytes}],
        }))
        .unwrap()
    }

    #[test]
    fn shear_is_three_numbers_a_vertex() {
        let ready = ready("shear", 24);
        let header = FrameHeader::pressure(1, 0, 0, SampleType::F32, 1.0);
        let header = header.windowed(Window::EMPTY);
        let mut message = header.encode().to_vec();
        message.extend([1f32, 2.0, 3.0, 4.0, 5.0].map(f32::to_le_bytes).as_flattened());
        let read = |message: &[u8]| Answer::read(&header, message, &ready, String::new());
        assert!(read(&message).is_err(), "the section has 24 bytes");
        message.extend(6f32.to_le_bytes());
        assert_eq!(read(&message).unwrap().shear_pa, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    }

    #[test]
    fn spikes_are_read_by_the_clock_of_the_frame() {
        let ready = ready("spikes", 24);
        let time_us = 7_000_000;
        let header = FrameHeader::pressure(1, time_us, 0, SampleType::F32, 1.0);
        let header = header.windowed(Window::EMPTY);
        let spikes = vec![Spike { unit: 4, time_us: 6_999_200 }, Spike { unit: 2, time_us }];
        let mut message = header.encode().to_vec();
        message.extend([9_u32.to_le_bytes(), 2_u32.to_le_bytes()].as_flattened());
        spikes.iter().for_each(|spike| message.extend(spike.encode(time_us)));
        let read = |message: &[u8]| Answer::read(&header, message, &ready, String::new());
        assert!(read(&message).is_err(), "the section has 24 bytes");
        message.extend([0; 8]);
        assert_eq!(read(&message).unwrap().fired, Some(Fired { total: 9, spikes }));
    }
}
