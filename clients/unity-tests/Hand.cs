using System;
using System.Linq;
using Newtonsoft.Json.Linq;
using Papilla;

/// <content>Steps of proto/conformance-contact.json.</content>
sealed partial class Run
{
    void Touch(JObject step, JObject expect)
    {
        if (step["poses"].Type == JTokenType.Null)
        {
            CheckTouch(step, expect, () => session.SendNotTracked((int?)step["finger"] ?? 0));
            return;
        }
        var poses = PosesOf(step);
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
        CheckTouch(step, expect, () => session.SendGaps(WithVelocity(step, depthMm), (int?)step["finger"] ?? 0, NetOf(step)));
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
        CheckTouch(step, expect, got);
    }
}
