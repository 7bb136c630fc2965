using Papilla;
using UnityEngine;

/// <summary>
/// A ball that the finger touches, and what pushes back on both. This object is the finger: its forward (z) points to the tip, its up (y) out of the nail, its
/// origin is the foremost point of the skin. Drive it with the mouse, or each frame with <c>Place.FingerOfJoints</c> of XR Hands.
/// </summary>
public sealed class PapillaTouch : MonoBehaviour
{
    [SerializeField] string address = "http://127.0.0.1:7224";
    [SerializeField] Rigidbody ball;
    [SerializeField] float radiusMm = 10;

    readonly Papilla.Pose[] poses = new Papilla.Pose[1];
    Session session;

    void Start()
    {
        var hello = new Hello { Objects = { new TouchObject { Shape = new SphereShape { RadiusMm = radiusMm } } }, Map = false };
        session = new Session(address, hello).Open();
    }

    void FixedUpdate()
    {
        poses[0] = ball.transform.PoseInFinger(transform);
        session.SendPoses(poses);
        Answer answer;
        if (!session.TryTakeLatest(out answer) || answer.NoContact) return;
        ball.AddForceAtPosition(-answer.Touch.ForceToUnity(transform), answer.Touch.CentreToUnity(transform));
    }

    void OnDestroy()
    {
        if (session != null) session.Dispose();
    }
}
