using System;
using System.IO;
using Papilla;

/// <summary>What the cases of the service do not reach: places that are none, and the drawn finger. Argument: an atlas.</summary>
static class FramesTest
{
    static int failures;

    static void Check(bool good, string what)
    {
        if (good) return;
        failures++;
        Console.WriteLine("FAILED: " + what);
    }

    static void Refuses(string word, Action act)
    {
        try
        {
            act();
            Check(false, word + " is taken");
        }
        catch (PapillaException error)
        {
            Check(error.Problem.Code == "bad_contact" && error.Message.Contains(word), error.Message);
        }
    }

    static int Main(string[] arguments)
    {
        var finger = new Place(0, 1, 0, 0, 0, 0, 2);
        var pose = Pose.FromUnity(finger, new Place(0.002, 0.992, -0.01125));
        Check(Math.Abs(pose.XMm - 11.25) < 1e-4 && Math.Abs(pose.YMm - 2) < 1e-4 && Math.Abs(pose.ZMm + 8) < 1e-4 && pose.TurnW == 1, "a level finger");
        Refuses("zero", () => Pose.FromUnity(default(Place), finger));
        Refuses("zero", () => Pose.FromUnity(finger, default(Place)));
        Refuses("finite", () => Pose.FromUnity(finger, new Place(0, double.NaN, 0)));
        Refuses("finite", () => Place.FingerOfJoints(new Place(double.PositiveInfinity, 0, 0), finger));
        Refuses("scale", () => Pose.FromUnity(finger, finger, 0));
        Refuses("scale", () => default(Touch).ToUnity(finger, double.NaN));
        Refuses("same place", () => Place.FingerOfJoints(finger, finger));
        Refuses("along", () => Place.FingerOfJoints(new Place(0, 0, 0), new Place(0, 0.02, 0)));
        Drawn(new Atlas(File.ReadAllText(arguments[0])));
        Console.WriteLine(failures == 0 ? "frames: all checks passed" : failures + " checks failed");
        return failures == 0 ? 0 : 1;
    }

    /// <summary>A ball placed at any vertex of the drawn finger is at that vertex; triangles are clockwise seen from outside, as Unity shows them.</summary>
    static void Drawn(Atlas atlas)
    {
        var drawn = new float[atlas.SkinMm.Length];
        for (int i = 0; i < drawn.Length; i += 3)
        {
            float x, y, z;
            Frames.ToUnity(atlas.SkinMm[i], atlas.SkinMm[i + 1], atlas.SkinMm[i + 2], out x, out y, out z);
            var there = Pose.FromUnity(new Place(0, 0, 0), new Place(x, y, z));
            float backX, backY, backZ;
            Frames.FromUnity(x, y, z, out backX, out backY, out backZ);
            double off = Math.Abs(there.XMm - atlas.SkinMm[i]) + Math.Abs(there.YMm - atlas.SkinMm[i + 1]) + Math.Abs(there.ZMm - atlas.SkinMm[i + 2]);
            Check(off < 1e-4 && Math.Abs(backX - atlas.SkinMm[i]) + Math.Abs(backZ - atlas.SkinMm[i + 2]) < 1e-4, "vertex " + i / 3);
            drawn[i] = x;
            drawn[i + 1] = y;
            drawn[i + 2] = z;
        }
        var triangles = Frames.Turned(atlas.Triangles);
        int outward = 0;
        for (int t = 0; t < triangles.Length; t += 3)
        {
            int a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
            // The side from which a triangle is clockwise in a left-handed world is that of this product; the axis of the finger is its z.
            double nx = (double)(drawn[b + 1] - drawn[a + 1]) * (drawn[c + 2] - drawn[a + 2]) - (double)(drawn[b + 2] - drawn[a + 2]) * (drawn[c + 1] - drawn[a + 1]);
            double ny = (double)(drawn[b + 2] - drawn[a + 2]) * (drawn[c] - drawn[a]) - (double)(drawn[b] - drawn[a]) * (drawn[c + 2] - drawn[a + 2]);
            if (nx * (drawn[a] + drawn[b] + drawn[c]) + ny * (drawn[a + 1] + drawn[b + 1] + drawn[c + 1]) > 0) outward++;
        }
        Check(outward > 0.95 * triangles.Length / 3, outward + " of " + triangles.Length / 3 + " triangles face outwards");
    }
}
