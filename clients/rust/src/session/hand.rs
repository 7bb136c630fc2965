//! Frames of a session with objects, gaps and fingers.

use papilla_proto::{
    FrameHeader, FrameKind, MAP_LEN, MAP_SIDE_PX, Problem, SampleType,
    contact::{Pose, ROW},
};
use tokio::sync::oneshot;

use super::{Session, now_us};
use crate::{Answer, PapillaError};

/// A net force to be met, in sessions whose hello says `force_target`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetForce {
    /// Unit vector in the finger's frame.
    pub direction: [f32; 3],
    /// Force on the finger along it, N.
    pub force_n: f32,
}

impl NetForce {
    fn row(self) -> [f32; ROW] {
        let [x, y, z] = self.direction;
        [x, y, z, self.force_n, 0.0, 0.0, 0.0]
    }
}

impl Session {
    /// Hands over where the objects of the hello are in a finger's frame, and returns at once; the
    /// newest poses of a finger replace those that have not left.
    ///
    /// # Errors
    /// The session is over.
    pub fn send_poses(
        &self,
        finger: u8,
        poses: &[Pose],
        net: Option<NetForce>,
    ) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        let rows = poses.len() + usize::from(net.is_some());
        let mut payload: Vec<u8> = poses.iter().flat_map(Pose::encode).collect();
        payload.extend(net.into_iter().flat_map(NetForce::row).flat_map(f32::to_le_bytes));
        self.send_rows(FrameKind::Objects, finger, [ROW, rows], &payload)
    }

    /// [`send_poses`](Self::send_poses), and waits for the outcome.
    ///
    /// # Errors
    /// As [`send_poses`](Self::send_poses).
    pub async fn touch(&self, finger: u8, poses: &[Pose]) -> Result<Answer, PapillaError> {
        let outcome = self.send_poses(finger, poses, None)?;
        outcome.await.map_err(|_| PapillaError::Closed)
    }

    /// Hands over how deep the undeformed skin lies in things (mm, negative in air), at the vertices
    /// or pixels as the hello said, f32. With [`Hello::velocity`](papilla_proto::Hello::velocity),
    /// x y z mm/s of each vertex follow the depths.
    ///
    /// # Errors
    /// The session is over.
    pub fn send_gaps(
        &self,
        finger: u8,
        depth_mm: &[f32],
        net: Option<NetForce>,
    ) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        let size = if depth_mm.len() == MAP_LEN {
            [MAP_SIDE_PX, MAP_SIDE_PX]
        } else {
            [depth_mm.len(), 1]
        };
        let row = net.into_iter().flat_map(NetForce::row);
        let payload: Vec<u8> =
            depth_mm.iter().copied().chain(row).flat_map(f32::to_le_bytes).collect();
        self.send_rows(FrameKind::Gaps, finger, size, &payload)
    }

    /// Hands over that tracking of a finger is lost, and returns at once. Better than an old pose, or
    /// one of zeros: the answer is zero, no unit fires, and nothing bursts when tracking comes back.
    ///
    /// # Errors
    /// The session is over.
    pub fn send_not_tracked(&self, finger: u8) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        let time_us = now_us();
        let message = |sequence| {
            // Of any session: kind and sample type of a frame without samples mean nothing.
            let header = FrameHeader::pressure(sequence, time_us, 0, SampleType::F32, 1.0);
            let header = FrameHeader { finger, ..header.not_tracked() };
            Ok::<_, Problem>(header.encode().to_vec())
        };
        let outcome = self.shared.state().put_message(finger, time_us, message)?;
        self.shared.wake.notify_one();
        Ok(outcome)
    }

    /// [`send_not_tracked`](Self::send_not_tracked), and waits for the outcome.
    ///
    /// # Errors
    /// As [`send_not_tracked`](Self::send_not_tracked).
    pub async fn not_tracked(&self, finger: u8) -> Result<Answer, PapillaError> {
        let outcome = self.send_not_tracked(finger)?;
        outcome.await.map_err(|_| PapillaError::Closed)
    }

    fn send_rows(
        &self,
        kind: FrameKind,
        finger: u8,
        [width, height]: [usize; 2],
        payload: &[u8],
    ) -> Result<oneshot::Receiver<Answer>, PapillaError> {
        let time_us = now_us();
        let message = |sequence| {
            let side = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
            let header = FrameHeader::pressure(sequence, time_us, 0, SampleType::F32, 1.0);
            let head = header.of_finger(kind, finger, [side(width), side(height)]).encode();
            Ok::<_, Problem>([&head[..], payload].concat())
        };
        let outcome = self.shared.state().put_message(finger, time_us, message)?;
        self.shared.wake.notify_one();
        Ok(outcome)
    }
}
