//! Frames of gaps: depths, and how fast objects move along the skin.

use papilla_contact::Gaps;
use papilla_proto::{
    Hello, Problem,
    atlas::VertexSampler,
    contact::{Input, SampleLayout},
};
use papilla_session_state::{Reader, StateError, Writer};

use super::{FrameForm, Skin, unusable};

/// Time between two frames that counts at most, s.
const PASSED_MAX_S: f32 = 1.0;
/// Fastest that a thing may move, mm/s.
const SPEED_MAX_MM_PER_S: f32 = 1e5;

/// What the frames of one finger say of gaps.
pub(crate) struct GapReader {
    depth_mm: Vec<f32>,
    friction: f64,
    /// Of depths that come as a map.
    sampler: Option<VertexSampler>,
    motion: Option<Motion>,
}

/// How far things have moved.
struct Motion {
    moved_mm: Vec<[f32; 3]>,
    /// Time of the last frame that was solved, by the client's clock.
    last_us: Option<u64>,
}

impl GapReader {
    /// Of a session whose frames are gaps; none of others.
    pub(crate) fn new(hello: &Hello, form: FrameForm, skin: Skin<'_>) -> Option<Self> {
        let vertices = skin.atlas.vertex_count();
        let motion = || Motion { moved_mm: vec![[0.0; 3]; vertices], last_us: None };
        let sampler = || VertexSampler::new(skin.atlas, skin.raster);
        (form.input == Input::Gaps).then(|| Self {
            depth_mm: vec![0.0; vertices],
            friction: hello.friction.unwrap_or(0.0),
            sampler: (form.layout == SampleLayout::Map).then(sampler),
            motion: form.has_vectors.then(motion),
        })
    }

    /// Takes the samples of a frame at `time_us` by the client's clock. Motion is velocity times the
    /// time since the frame [solved](Self::solved) last, of which a second counts at most: none in
    /// the first frame, and where the clock has not gone on.
    ///
    /// # Errors
    /// A velocity that is none. Depths are judged by the solver.
    pub(crate) fn read(&mut self, samples: &[f32], time_us: u64) -> Result<(), Problem> {
        let Self { depth_mm, sampler, motion, .. } = self;
        let vertices = depth_mm.len();
        match sampler {
            // A NaN anywhere on the skin shows at a vertex, and is refused there.
            Some(sampler) => _ = sampler.sample(samples, depth_mm),
            None => depth_mm.copy_from_slice(&samples[..vertices]),
        }
        let Some(Motion { moved_mm, last_us }) = motion else { return Ok(()) };
        let passed_us = last_us.map_or(0, |last_us| time_us.saturating_sub(last_us));
        let passed_s = (passed_us as f32 * 1e-6).min(PASSED_MAX_S);
        let velocities = samples[vertices..].as_chunks::<3>().0;
        for (vertex, (moved, velocity)) in moved_mm.iter_mut().zip(velocities).enumerate() {
            if let Some(v) = velocity.iter().find(|v| !(v.abs() <= SPEED_MAX_MM_PER_S)) {
                let message = format!("{v} mm/s is not within {SPEED_MAX_MM_PER_S} mm/s");
                return Err(unusable(format!("velocity_mm_per_s[{vertex}]"), message));
            }
            *moved = velocity.map(|v| v * passed_s);
        }
        Ok(())
    }

    /// Takes note that the frame of this time was solved.
    pub(crate) fn solved(&mut self, time_us: u64) {
        if let Some(motion) = &mut self.motion {
            motion.last_us = Some(time_us);
        }
    }

    /// Nobody knows where things are: they have not moved until somebody does.
    pub(crate) fn lose(&mut self) {
        if let Some(motion) = &mut self.motion {
            motion.last_us = None;
        }
    }

    /// What the last frame said.
    pub(crate) fn gaps(&self) -> Gaps<'_> {
        let moved_mm = self.motion.as_ref().map_or(&[][..], |motion| &motion.moved_mm);
        Gaps { friction: self.friction, moved_mm, ..Gaps::rigid(&self.depth_mm) }
    }

    pub(crate) fn save(&self, state: &mut Writer) {
        if let Some(motion) = &self.motion {
            state.option(motion.last_us);
        }
    }

    pub(crate) fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        if let Some(motion) = &mut self.motion {
            motion.last_us = state.option()?;
        }
        Ok(())
    }
}
