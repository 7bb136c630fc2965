using System;
using System.Linq;
using Newtonsoft.Json.Linq;
using Papilla;

/// <content>Bodies where Unity says that they are, in the cases that say so.</content>
sealed partial class Run
{
    static Place PlaceOf(JToken seven)
    {
        var v = seven.Select(one => (double)one).ToArray();
        return new Place(v[0], v[1], v[2], v[3], v[4], v[5], v[6]);
    }

    /// <summary>The step's poses; by this client's own conversion where the step says where Unity has them.</summary>
    static Pose[] PosesOf(JObject step)
    {
        var poses = step["poses"].Select(row => row.Select(v => (float)v).ToArray()).Select(v => new Pose(v[0], v[1], v[2], v[3], v[4], v[5], v[6])).ToArray();
        if (step["engines"] == null) return poses;
        var said = step["engines"]["unity"];
        var joints = said["joints"];
        var bodies = said["objects"].Select(PlaceOf).ToArray();
        SamePoses("of joints", Placed(Place.FingerOfJoints(PlaceOf(joints["distal"]), PlaceOf(joints["tip"]), (double)joints["inside_mm"]), bodies), poses);
        var placed = Placed(PlaceOf(said["finger"]), bodies);
        SamePoses("placed", placed, poses);
        return placed;
    }

    static Pose[] Placed(Place finger, Place[] bodies)
    {
        return bodies.Select(body => Pose.FromUnity(finger, body)).ToArray();
    }

    /// <summary>Places within some micrometres, quaternions up to their sign.</summary>
    static void SamePoses(string what, Pose[] found, Pose[] due)
    {
        for (int k = 0; k < due.Length; k++)
        {
            Pose f = found[k], d = due[k];
            double off = Math.Abs(f.XMm - d.XMm) + Math.Abs(f.YMm - d.YMm) + Math.Abs(f.ZMm - d.ZMm);
            double dot = f.TurnX * d.TurnX + f.TurnY * d.TurnY + f.TurnZ * d.TurnZ + f.TurnW * d.TurnW;
            if (!(off < 5e-3) || !(Math.Abs(dot) > 1 - 1e-6)) throw new Missed(what + ": the object is at " + f.XMm + " " + f.YMm + " " + f.ZMm + ", turned by " + dot);
        }
    }

    /// <summary>What Unity's world feels of a touch.</summary>
    static void CheckFelt(JObject step, Touch touch)
    {
        if (step["engines"] == null) return;
        var felt = touch.ToUnity(PlaceOf(step["engines"]["unity"]["finger"]));
        var due = (JObject)step["expect"]["engines"]["unity"];
        All("force_n", due, new[] { (float)felt.ForceX, (float)felt.ForceY, (float)felt.ForceZ });
        All("torque_n_m", due, new[] { (float)felt.TorqueX, (float)felt.TorqueY, (float)felt.TorqueZ });
        All("centre", due, new[] { (float)felt.X, (float)felt.Y, (float)felt.Z });
    }
}
