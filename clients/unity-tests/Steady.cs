using System;
using System.Threading;
using Newtonsoft.Json.Linq;
using Papilla;

/// <summary>Frames and answers allocate nothing: 900 frames, one after the other, and the heap is what it was. `contact`: of poses.</summary>
static class Steady
{
    const int Warm = 100, Frames = 900;
    const string Ball = "{'input': 'objects', 'objects': [{'shape': {'shape': 'sphere', 'radius_mm': 10}}], 'pressure': 'vertices', 'answer_layout': 'vertices'}";

    static int Main(string[] arguments)
    {
        // Two springs in a row, 10 and 30 kPa/mm: the softer takes three quarters of a millimetre.
        var springs = new Foundation { Stiffness = 10000, Exponent = 1, Relief = 0 };
        var vertexPa = new float[1];
        springs.Pressures(new float[] { 1 }, vertexPa, float.MaxValue, 30000);
        if (Math.Abs(springs.FingerShare - 0.75) > 1e-6 || Math.Abs(vertexPa[0] - 7500) > 0.01) throw new Exception("soft object: " + vertexPa[0] + " Pa");
        bool isContact = arguments.Length > 0 && arguments[0] == "contact";
        var pressurePa = new float[Wire.MapLength];
        for (int k = 0; k < 5000; k++) pressurePa[20000 + k] = 3000;
        var poses = new[] { new Pose(11.25f, 0, -16.2f) };
        var hello = isContact ? Hello.FromJson(JObject.Parse(Ball)) : new Hello { Tier = "half-space" };
        using (var session = new Session(Environment.GetEnvironmentVariable("PAPILLA_URL"), hello).Open())
        {
            session.WaitReady(20000);
            return Run(session, () => isContact ? session.SendPoses(poses) : session.Send(pressurePa));
        }
    }

    static int Run(Session session, Func<uint> send)
    {
        long before = 0;
        int collections = 0;
        for (int k = 0; k < Warm + Frames; k++)
        {
            if (k == Warm)
            {
                GC.Collect();
                before = GC.GetTotalMemory(true);
                collections = GC.CollectionCount(0);
            }
            uint sequence = send();
            Answer answer = null;
            while (!session.TryTakeLatest(out answer)) Thread.Sleep(0);
            if (answer.Sequence != sequence || answer.Status != Status.Ok) throw new Exception("frame " + sequence + ": " + answer.Status);
        }
        long grown = GC.GetTotalMemory(false) - before;
        int collected = GC.CollectionCount(0) - collections;
        Console.WriteLine("{0} bytes in {1} frames, {2} collections", grown, Frames, collected);
        // The heap is counted by blocks of some KiB; one object a frame would be 20 KiB.
        return collected == 0 && grown < 8192 ? 0 : 1;
    }
}
