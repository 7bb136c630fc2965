using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using Newtonsoft.Json.Linq;
using Papilla;

/// <summary>The cases without a wire by the native library. Arguments: folder of models, contact model.</summary>
static class Native
{
    // Of sockets, of other sample types than floats, of windows that are sent, of helpers of the clients.
    static readonly string[] OfTheWire =
    {
        "f16", "u16", "u8", "mixed-types", "windows", "window-u8", "new-terms", "late", "stale", "burst", "latest-wins", "reconnect", "http", "contacts",
        "addresses", "tokens", "silence", "budget",
    };

    static int Main(string[] arguments)
    {
        Run.CheckLocale();
        var file = JObject.Parse(File.ReadAllText(Environment.GetEnvironmentVariable("PAPILLA_CONFORMANCE")));
        int failed = 0;
        foreach (var one in file["cases"])
        {
            if (OfTheWire.Contains((string)one["name"]))
            {
                Console.WriteLine("skip " + one["name"] + ": of the wire");
                continue;
            }
            using (var run = new Run(arguments[0], arguments[1])) failed += run.Passes(one) ? 0 : 1;
        }
        return failed == 0 ? 0 : 1;
    }
}

/// <summary>One case.</summary>
sealed partial class Run : IDisposable
{
    readonly string folder, contact;
    readonly Dictionary<int, string> tiers = new Dictionary<int, string>();
    NativeModel model;
    NativeSession session;
    // Things move between frames a hundredth of a second apart.
    ulong frames;

    internal Run(string folder, string contact)
    {
        this.folder = folder;
        this.contact = contact;
    }

    public void Dispose()
    {
        if (session != null) session.Dispose();
        if (model != null) model.Dispose();
    }

    internal void Do(JObject step)
    {
        var expect = (JObject)step["expect"];
        switch ((string)step["do"])
        {
            case "hello": Hello(step, expect); break;
            // Whole maps alone are taken.
            case "frame": if (step["window"] == null) Check(expect, Of(() => session.Send(Pattern((JObject)step["pressure"], 1), (ulong?)step["client_time_us"] ?? 0))); break;
            case "touch": Touch(step, expect); break;
            case "gaps": CheckTouch(step, expect, Of(() => session.SendGaps(GapsOf(step), 10000 * ++frames, (int?)step["finger"] ?? 0, NetOf(step)), step)); break;
            case "rasterise": Rasterise(step, expect); break;
            default: throw new Missed("no step " + step["do"]);
        }
    }

    void Touch(JObject step, JObject expect)
    {
        int finger = (int?)step["finger"] ?? 0;
        Func<NativeAnswer> lost = () => session.SendNotTracked(0, finger), seen = () => session.SendPoses(PosesOf(step), 0, finger, NetOf(step));
        CheckTouch(step, expect, Of(step["poses"].Type == JTokenType.Null ? lost : seen, step));
    }

    void Hello(JObject step, JObject expect)
    {
        var hello = (JObject)step["hello"];
        string tier = (string)hello["tier"];
        if (model != null) model.Dispose();
        // A folder has no model that a case calls unknown: the hello is then refused by another one.
        model = new NativeModel(folder, tier != null && File.Exists(Path.Combine(folder, tier + ".onnx")) ? tier : null, contact);
        tiers[0] = model.Name;
        try
        {
            if (session == null) session = new NativeSession(model, TypedHello.Of(hello));
            else session.Open(model, TypedHello.Of(hello));
        }
        catch (PapillaException error)
        {
            Same("status (" + error.Message + ")", "error", (string)expect["status"] ?? "ok");
            Same("code", error.Problem.Code, (string)expect["code"]);
            if (expect["field"] != null) Same("field", error.Problem.Field, (string)expect["field"]);
            return;
        }
        if ((string)expect["status"] == "error") throw new Missed("the hello was taken");
        var ready = expect["ready"] ?? new JObject();
        if (ready["atlas_hash"] != null) Same("atlas", model.AtlasHash, (string)ready["atlas_hash"]);
        if (ready["vertices"] != null) Same("vertices", model.VertexCount.ToString(), (string)ready["vertices"]);
        if (ready["tier"] != null) Same("tier", model.Name, (string)ready["tier"]);
        if (ready["method"] != null) Same("method", session.Method, (string)ready["method"]);
    }

    /// <summary>What a frame came to, in the words of the client with a socket.</summary>
    static Outcome Of(Func<NativeAnswer> send, JObject step = null)
    {
        try
        {
            var a = send();
            var map = new float[Wire.MapLength];
            for (int i = 0; i < a.Width * a.Height; i++) map[(a.Row + i / a.Width) * 224 + a.Column + i % a.Width] = a.Map[i];
            return new Outcome
            {
                Status = Status.Ok, Map = map, Window = new[] { a.Column, a.Row, a.Width, a.Height }, NotTracked = a.NotTracked, CoarseClock = a.CoarseClock,
                Rates = a.RatesHz.Length == 0 ? null : a.RatesHz, PointRatesHz = a.PointRatesHz,
                Summary = a.Summary, Points = a.Points, Actuators = a.Actuators, PressurePa = a.PressurePa,
                OutOfRange = a.OutOfRange, NoContact = a.NoContact, Unfamiliar = a.Unfamiliar, Unsettled = a.Unsettled, CutOff = a.CutOff,
                ErrorEstimate = a.ErrorEstimate, HasTouch = a.HasTouch, Touch = a.Touch, Finger = step == null ? 0 : (int?)step["finger"] ?? 0,
            };
        }
        catch (PapillaException error)
        {
            return new Outcome { Status = Status.Error, Code = error.Problem.Code, Field = error.Problem.Field };
        }
    }

    static NetForce? NetOf(JObject step)
    {
        if (step["net"] == null) return null;
        var net = step["net"].Select(v => (float)v).ToArray();
        return new NetForce { X = net[0], Y = net[1], Z = net[2], ForceN = net[3] };
    }

    /// <summary>A value of each vertex, from its squared distance of a point.</summary>
    float[] AtVertices(JToken at, Func<double, double> of)
    {
        var values = new float[model.VertexCount];
        for (int i = 0; i < values.Length; i++)
        {
            double d2 = 0;
            for (int k = 0; k < 3; k++) d2 += Math.Pow(model.SkinMm[3 * i + k] - (double)at[k], 2);
            values[i] = (float)of(d2);
        }
        return values;
    }

    float[] GapsOf(JObject step)
    {
        return WithVelocity(step, AtVertices(step["sphere"], d2 => (double)step["sphere"][3] - Math.Sqrt(d2)));
    }

    void Rasterise(JObject step, JObject expect)
    {
        model = new NativeModel(folder);
        var g = step["vertices"]["gaussian_mm"];
        var map = new float[Wire.MapLength];
        model.Rasterise(AtVertices(g, d2 => (double)g[4] * Math.Exp(-d2 / (2 * (double)g[3] * (double)g[3]))), map);
        CheckMap(expect, map);
    }
}
