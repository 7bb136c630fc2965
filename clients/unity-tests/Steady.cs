using System;
using System.Threading;
using Newtonsoft.Json.Linq;
using Papilla;

/// <summary>Frames and answers allocate nothing: 900 frames, one after the other, and the heap is what it was. `contact`: of poses.</summary>
static class Steady
{
    const int Warm = 100, Frames = 900;
    static readonly Hello Ball = new Hello
    {
        Objects = { new TouchObject { Shape = new SphereShape { RadiusMm = 10 } } },
        Pressure = SampleLayout.Vertices, AnswerLayout = SampleLayout.Vertices, Shear = true, Displacement = true, Effects = { new SpikesEffect() },
    };

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
        // In turns, so that units fire.
        var poses = new[] { new[] { new Pose(11.25f, 0, -16.2f) }, new[] { new Pose(11.25f, 0, -15.8f) } };
        int turn = 0;
        var hello = isContact ? Ball : new Hello { Tier = "half-space" };
        using (var session = new Session(Environment.GetEnvironmentVariable("PAPILLA_URL"), hello).Open())
        {
            session.WaitReady(20000);
            return Run(session, () => isContact ? session.SendPoses(poses[turn++ % 2]) : session.Send(pressurePa), isContact);
        }
    }

    static int Run(Session session, Func<uint> send, bool isContact)
    {
        long before = 0;
        int collections = 0;
        long spikes = 0, units = session.Ready.Json["units"] == null ? 0 : ((JArray)session.Ready.Json["units"]).Count;
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
            if ((answer.Spikes != null) != isContact || (answer.ShearPa != null) != isContact || (answer.DisplacementMm != null) != isContact) throw new Exception("spikes and shear are not as asked for");
            for (int spike = 0; spike < answer.SpikeCount; spike++, spikes++)
            {
                // Of this frame and of the 65 ms before it.
                long beforeUs = (long)answer.ClientTimeUs - answer.Spikes[spike].TimeUs;
                if (beforeUs < 0 || beforeUs > 65535 || answer.Spikes[spike].Unit >= units) throw new Exception("spike " + spike + " is " + beforeUs + " us old");
            }
            if (isContact && answer.SpikesTotal != spikes) throw new Exception(answer.SpikesTotal + " spikes, " + spikes + " came");
            if (answer.Sequence != sequence || answer.Status != Status.Ok) throw new Exception("frame " + sequence + ": " + answer.Status);
        }
        long grown = GC.GetTotalMemory(false) - before;
        int collected = GC.CollectionCount(0) - collections;
        if (isContact && spikes == 0) throw new Exception("no unit fired");
        Console.WriteLine("{0} bytes in {1} frames, {2} collections", grown, Frames, collected);
        // The heap is counted by blocks of some KiB; one object a frame would be 20 KiB.
        return collected == 0 && grown < 8192 ? 0 : 1;
    }
}
