using System.Collections.Generic;
using Papilla;
using UnityEngine;
#if PAPILLA_XR_HANDS
using UnityEngine.XR.Hands;
#endif

/// <summary>The right index finger of the package XR Hands; nothing where that package is not installed (see PapillaHands.asmdef).</summary>
static class HandJoints
{
#if PAPILLA_XR_HANDS
    static readonly List<XRHandSubsystem> subsystems = new List<XRHandSubsystem>();

    /// <param name="rig">the XR origin, which poses of joints are relative to</param>
    internal static bool TryFinger(Transform rig, out Place finger)
    {
        finger = new Place(0, 0, 0);
        SubsystemManager.GetSubsystems(subsystems);
        if (subsystems.Count == 0 || !subsystems[0].rightHand.isTracked) return false;
        UnityEngine.Pose distal, tip;
        var hand = subsystems[0].rightHand;
        if (!hand.GetJoint(XRHandJointID.IndexDistal).TryGetPose(out distal) || !hand.GetJoint(XRHandJointID.IndexTip).TryGetPose(out tip)) return false;
        finger = Place.FingerOfJoints(InWorld(distal, rig), InWorld(tip, rig));
        return true;
    }

    static Place InWorld(UnityEngine.Pose of, Transform rig)
    {
        return new UnityEngine.Pose(rig.TransformPoint(of.position), rig.rotation * of.rotation).ToPlace();
    }
#else
    internal static bool TryFinger(Transform rig, out Place finger)
    {
        finger = new Place(0, 0, 0);
        return false;
    }
#endif
}
