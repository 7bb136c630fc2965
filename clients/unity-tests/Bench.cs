using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Linq;
using System.Threading;
using Papilla;

/// <summary>
/// Round trips of whole f32 maps, one JSON line: --rate-hz 90 --duration-s 60. From the instant at which a frame was due to
/// the answer in the user's hands.
/// </summary>
static class Bench
{
    static int Main(string[] arguments)
    {
        double rateHz = Number(arguments, "--rate-hz", 90), durationS = Number(arguments, "--duration-s", 60);
        int count = (int)(rateHz * durationS), warm = 50;
        var latencies = new long[count + warm];
        var due = new Dictionary<uint, ulong>(count + warm + 1);
        int answered = 0, missed = 0;
        bool isFramework = arguments.Contains("client-web-socket");
        var session = new Session(Environment.GetEnvironmentVariable("PAPILLA_URL"), new Hello { Tier = "half-space" }, null,
            isFramework ? (Func<ITransport>)(() => new ClientWebSocketTransport()) : null);
        session.Answered += answer =>
        {
            if (answer.Status != Status.Ok) { missed++; return; }
            ulong at;
            lock (due) if (!due.TryGetValue(answer.Sequence, out at)) return;
            latencies[answered++] = (long)(Session.Now() - at);
        };
        session.Open().WaitReady();
        var maps = Enumerable.Range(0, 16).Select(k => Map(k / 16.0)).ToArray();
        long before = 0;
        int collections = 0;
        ulong start = Session.Now() + 10000;
        uint next = 1;
        for (int k = 0; k < count + warm; k++)
        {
            ulong at = start + (ulong)(k * 1e6 / rateHz);
            while (Session.Now() + 1500 < at) Thread.Sleep(1);
            while (Session.Now() < at) Thread.SpinWait(50);
            if (k == warm)
            {
                GC.Collect();
                before = GC.GetTotalMemory(true);
                collections = GC.CollectionCount(0);
            }
            // The entry is there before the answer can be.
            lock (due) due[next] = at;
            next = session.Send(maps[k % maps.Length]) + 1;
        }
        long after = GC.GetTotalMemory(false);
        int collected = GC.CollectionCount(0) - collections;
        for (int k = 0; k < 2000 && answered + missed < count + warm; k++) Thread.Sleep(1);
        session.Dispose();
        var sorted = latencies.Skip(warm).Take(answered - warm).OrderBy(v => v).ToArray();
        Console.WriteLine("{{\"client\": \"unity{0}\", \"rate_hz\": {1}, \"frames\": {2}, \"missing\": {3}, \"p50_us\": {4}, \"p99_us\": {5}, \"max_us\": {6}, \"allocated_bytes_per_frame\": {7:0.0}, \"collections\": {8}}}",
            isFramework ? "-client-web-socket" : "", rateHz, sorted.Length, missed, sorted[sorted.Length / 2], sorted[(int)(0.99 * sorted.Length)], sorted[sorted.Length - 1], (double)(after - before) / count, collected);
        return 0;
    }

    static double Number(string[] arguments, string name, double otherwise)
    {
        int at = Array.IndexOf(arguments, name);
        return at < 0 ? otherwise : double.Parse(arguments[at + 1], System.Globalization.CultureInfo.InvariantCulture);
    }

    static float[] Map(double phase)
    {
        var map = new float[Wire.MapLength];
        double u0 = 112 + 20 * Math.Cos(2 * Math.PI * phase), v0 = 112 + 20 * Math.Sin(2 * Math.PI * phase);
        for (int i = 0; i < map.Length; i++)
        {
            double u = i % 224 + 0.5, v = i / 224 + 0.5;
            map[i] = (float)(15000 * Math.Exp(-((u - u0) * (u - u0) + (v - v0) * (v - v0)) / 288));
        }
        return map;
    }
}
