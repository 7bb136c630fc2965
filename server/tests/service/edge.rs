//! What presses at the edge of the skin that is known, and deep in the finger.

use papilla_proto::{contact::Pose, flags};
use serde_json::json;

use crate::support::contact::{ball_hello, rows, service};

/// Flags of the contact itself.
const OF_CONTACT: u8 = flags::CUT_OFF | flags::NO_CONTACT | flags::UNSETTLED;

/// A force that lacks what lies beyond the edge is flagged also where nobody asks for SED, exactly
/// when it is flagged with a map; so is one that did not settle, and none that a body in the finger has.
#[tokio::test(flavor = "multi_thread")]
async fn a_force_alone_is_flagged_as_with_a_map() {
    const BALL_MM: f32 = 3.0;
    let service = service().await;
    let objects = json!([{"shape": {"shape": "sphere", "radius_mm": BALL_MM}}]);
    for method in ["second_order", "pixels"] {
        let mut seen = [0, 0];
        let mut sockets = [service.socket().await, service.socket().await];
        for (socket, map) in sockets.iter_mut().zip([true, false]) {
            let hello = json!({"objects": objects, "map": map, "method": method});
            socket.open(ball_hello(&hello)).await;
        }
        let aside = (0u8..24).map(|step| [0.5 * f32::from(step), 0.0, 0.3 - BALL_MM]);
        let deep = (0u8..24).map(|step| [0.0, 0.0, 0.5 * f32::from(step) - BALL_MM]);
        for (sequence, origin_mm) in (1..).zip(aside.chain(deep)) {
            let pose = Pose { origin_mm, ..Pose::default() };
            let mut found = [0, 0];
            for (socket, found) in sockets.iter_mut().zip(&mut found) {
                socket.send(rows(sequence, 0, &[pose])).await;
                *found = socket.hear_frame().await.0.flags & OF_CONTACT;
            }
            assert_eq!(found[0], found[1], "{method}, {origin_mm:?}");
            seen[usize::from(found[1] & flags::CUT_OFF != 0)] += 1;
        }
        assert!(seen.iter().all(|count| *count > 0), "{method}: {seen:?}");
    }
}
