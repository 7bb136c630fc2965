using System;
using System.Linq;
using Newtonsoft.Json.Linq;
using Papilla;

/// <content>Steps of proto/conformance-contact.json.</content>
sealed partial class Run
{
    void Touch(JObject step, JObject expect)
    {
        var poses = step["poses"].Select(row => row.Select(v => (float)v).ToArray()).Select(v => new Pose(v[0], v[1], v[2], v[3], v[4], v[5], v[6])).ToArray();
        CheckTouch(step, expect, () => session.SendPoses(poses, (int?)step["finger"] ?? 0, NetOf(step)));
    }

    void Gaps(JObject step, JObject expect)
    {
        var sphere = step["sphere"].Select(v => (double)v).ToArray();
        var depthMm = new float[atlas.VertexCount];
        for (int i = 0; i < depthMm.Length; i++)
        {
            double d2 = 0;
            for (int k = 0; k < 3; k++) d2 += Math.Pow(atlas.SkinMm[3 * i + k] - sphere[k], 2);
            depthMm[i] = (float)(sphere[3] - Math.Sqrt(d2));
        }
        CheckTouch(step, expect, () => session.SendGaps(depthMm, (int?)step["finger"] ?? 0, NetOf(step)));
    }

    static NetForce? NetOf(JObject step)
    {
        if (step["net"] == null) return null;
        var net = step["net"].Select(v => (float)v).ToArray();
        return new NetForce { X = net[0], Y = net[1], Z = net[2], ForceN = net[3] };
    }

    void CheckTouch(JObject step, JObject expect, Func<uint> send)
    {
        uint sequence = send();
        var got = Until("the outcome", () => Of(sequence), patienceMs);
        Same("status (" + got.Code + ")", got.Status.ToString().ToLowerInvariant(), (string)expect["status"] ?? "ok");
        if (expect["code"] != null) Same("code", got.Code, (string)expect["code"]);
        if (expect["field"] != null) Same("field", got.Field, (string)expect["field"]);
        if (got.Status != Status.Ok) return;
        if (!got.HasTouch || got.Finger != ((int?)step["finger"] ?? 0)) throw new Missed("no touch, or of finger " + got.Finger);
        var t = got.Touch;
        var found = new[]
        {
            t.ForceXN, t.ForceYN, t.ForceZN, t.TorqueXNMm, t.TorqueYNMm, t.TorqueZNMm, t.AreaMm2, t.CentreXMm, t.CentreYMm, t.CentreZMm,
            t.PenetrationMm, t.StiffnessNPerMm, t.TravelMm, t.PressureMaxPa, t.Share,
        };
        All("touch", expect, found);
        if (expect["pressure_sum"] != null) Near("pressure", got.PressurePa.Sum(v => (double)v), (double)expect["pressure_sum"][0], (double)expect["pressure_sum"][1]);
        if (got.NoContact != expect["flags"].Any(f => (string)f == "no_contact")) throw new Missed("no contact is " + got.NoContact);
        if (got.OutOfRange || got.Unsettled) throw new Missed("out of range or unsettled");
    }
}
