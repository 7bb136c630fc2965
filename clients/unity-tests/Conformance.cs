using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.IO;
using System.Linq;
using System.Net;
using System.Threading;
using Newtonsoft.Json.Linq;
using Papilla;

/// <summary>The steps of docs/reference/conformance.md by this client. --transport client-web-socket: with the framework's WebSocket.</summary>
static class Conformance
{
    static int Main(string[] arguments)
    {
        Run.CheckLocale();
        var file = JObject.Parse(File.ReadAllText(Environment.GetEnvironmentVariable("PAPILLA_CONFORMANCE")));
        var url = Environment.GetEnvironmentVariable("PAPILLA_URL");
        var atlas = PapillaHttp.LoadAtlas(url);
        if (atlas.Hash != (string)file["atlas_hash"]) throw new Exception("another atlas: " + atlas.Hash);
        bool isFramework = arguments.Contains("client-web-socket");
        int failed = 0;
        foreach (var one in file["cases"])
        {
            using (var run = new Run(url, atlas, 1000 * (int)file["timeout_s"], isFramework)) failed += run.Passes(one) ? 0 : 1;
        }
        return failed == 0 ? 0 : 1;
    }
}

/// <summary>One case.</summary>
sealed partial class Run : IDisposable
{
    readonly string url;
    readonly Atlas atlas;
    readonly int patienceMs;
    readonly bool isFramework;
    readonly object gate = new object();
    readonly Dictionary<uint, Outcome> outcomes = new Dictionary<uint, Outcome>();
    readonly List<uint> order = new List<uint>();
    readonly Dictionary<int, string> tiers = new Dictionary<int, string>();
    Session session;
    object reply;
    string twice;
    int connections = 1;
    ulong clockUs;

    internal Run(string url, Atlas atlas, int patienceMs, bool isFramework)
    {
        this.url = url;
        this.atlas = atlas;
        this.patienceMs = patienceMs;
        this.isFramework = isFramework;
    }

    public void Dispose()
    {
        if (session != null) session.Dispose();
    }

    internal void Do(JObject step)
    {
        var expect = (JObject)step["expect"];
        switch ((string)step["do"])
        {
            case "address": Address((string)step["address"], expect); break;
            case "silence": Silence(step); break;
            case "token": Token((string)step["token"], expect); break;
            case "hello": Hello(step, expect); break;
            case "frame": Frame(step, expect); break;
            case "burst": Burst(step, expect); break;
            case "reconnect": Reconnect((double)step["within_s"]); break;
            case "move": Moved((double)step["within_s"]); break;
            case "stay": Stayed((string)step["says"], (double)step["within_s"]); break;
            case "http": Http(step, expect); break;
            case "rasterise": Rasterise(step, expect); break;
            case "contacts": Contacts(step, expect); break;
            case "touch": Touch(step, expect); break;
            case "gaps": Gaps(step, expect); break;
            default: throw new Missed("no step " + step["do"]);
        }
    }

    void Address(string text, JObject expect)
    {
        if ((string)expect["status"] == "error")
        {
            Throws(() => new Session(text), expect);
            Throws(() => PapillaHttp.LoadAtlas(text), expect);
            return;
        }
        var address = new ServerAddress(text);
        Same("sessions of " + text, address.Session(), (string)expect["session"]);
        Same("the atlas of " + text, address.Http("/v1/atlas"), (string)expect["http"]);
        new Session(text).Dispose();
    }

    void Token(string token, JObject expect)
    {
        if ((string)expect["status"] == "error") Throws(() => new Session(url, null, token), expect);
        else Same("the token", ServerAddress.CleanToken(token), (string)expect["token"]);
    }

    static void Throws(Action use, JObject expect)
    {
        try
        {
            use();
        }
        catch (PapillaException error)
        {
            Same("code", error.Problem.Code, (string)expect["code"]);
            if (!error.Message.Contains((string)expect["says"] ?? "")) throw new Missed(error.Message);
            return;
        }
        throw new Missed("it is taken");
    }

    void Hello(JObject step, JObject expect)
    {
        var hello = TypedHello.Of((JObject)step["hello"]);
        lock (gate) reply = null;
        if (session == null)
        {
            session = new Session(url, hello, null, isFramework ? (Func<ITransport>)(() => new ClientWebSocketTransport()) : null);
            session.ClockUs = () => clockUs != 0 ? clockUs : Session.Now();
            session.SessionReady += ready => { lock (gate) { reply = ready; tiers[ready.TierNumber] = ready.Tier; Monitor.PulseAll(gate); } };
            session.Refused += problem => { lock (gate) { reply = problem; Monitor.PulseAll(gate); } };
            session.Answered += Keep;
            session.Warn = null;
            session.TimeoutMs = patienceMs;
            session.Open();
        }
        else
        {
            session.Renew(hello);
        }
        object got = Until("a reply", () => reply, patienceMs);
        var refused = got as Problem;
        if ((string)expect["status"] == "error")
        {
            if (refused == null) throw new Missed("the hello was taken");
            Same("code", refused.Code, (string)expect["code"]);
            if (expect["field"] != null) Same("field", refused.Field, (string)expect["field"]);
            return;
        }
        if (refused != null) throw new Missed(refused.ToString());
        foreach (var words in expect["warnings"] ?? new JArray()) Told((string)words);
        foreach (var member in (JObject)expect["ready"] ?? new JObject())
        {
            if (!JToken.DeepEquals(((Ready)got).Json[member.Key], member.Value)) throw new Missed("ready." + member.Key + " is " + ((Ready)got).Json[member.Key]);
        }
    }

    void Keep(Answer a)
    {
        lock (gate)
        {
            if (outcomes.ContainsKey(a.Sequence)) twice = "frame " + a.Sequence + " has two outcomes";
            outcomes[a.Sequence] = new Outcome
            {
                Status = a.Status, Code = a.Problem == null ? null : a.Problem.Code, Field = a.Problem == null ? null : a.Problem.Field,
                Map = (float[])a.Map.Clone(), Summary = a.HasSummary ? (float[])a.Summary.Clone() : null,
                Points = a.Points.Take(a.PointCount).ToArray(), Actuators = a.Actuators.Take(a.ActuatorCount).ToArray(),
                Window = new[] { a.Column, a.Row, a.Width, a.Height }, NotTracked = a.NotTracked, CoarseClock = a.CoarseClock, Rates = a.Rates == null ? null : (float[])a.Rates.Clone(), PointRatesHz = a.PointRatesHz == null ? null : (float[])a.PointRatesHz.Clone(), OutOfRange = a.OutOfRange, NoContact = a.NoContact, Unfamiliar = a.Unfamiliar, CutOff = a.CutOff,
                ErrorEstimate = a.ErrorEstimate, HasTouch = a.HasTouch, Touch = a.Touch, Finger = a.Finger, Unsettled = a.Unsettled, PressurePa = a.PressurePa == null ? null : (float[])a.PressurePa.Clone(),
                ClientTimeUs = a.ClientTimeUs, TierNumber = a.TierNumber, TotalUs = a.TotalUs, QueueUs = a.QueueUs, InferUs = a.InferUs,
            };
            order.Add(a.Sequence);
            Monitor.PulseAll(gate);
        }
    }

    void Frame(JObject step, JObject expect)
    {
        var map = Pattern((JObject)step["pressure"], 1);
        session.DeadlineUs = (uint?)step["deadline_us"] ?? 0;
        int attempts = (int?)step["attempts"] ?? 1;
        while (true)
        {
            clockUs = (ulong?)step["client_time_us"] ?? 0;
            ulong before = Session.Now();
            uint sequence;
            try
            {
                sequence = step["window"] == null ? session.Send(map) : SendWindow(map, step["window"].Select(v => (int)v).ToArray());
            }
            catch (PapillaException error)
            {
                Check(expect, new Outcome { Status = Status.Error, Code = error.Problem.Code });
                return;
            }
            ulong after = Session.Now();
            var outcome = Until("the outcome", () => Of(sequence), patienceMs);
            if (outcome.Status == Status.Lost && --attempts > 0) continue;
            if (outcome.Status != Status.Error && outcome.Status != Status.Lost)
            {
                bool isRight = clockUs != 0 ? outcome.ClientTimeUs == clockUs : outcome.ClientTimeUs >= before && outcome.ClientTimeUs <= after;
                if (!isRight) throw new Missed("client time " + outcome.ClientTimeUs);
            }
            Check(expect, outcome);
            return;
        }
    }

    uint SendWindow(float[] map, int[] w)
    {
        var samples = new float[w[2] * w[3]];
        for (int y = 0; y < w[3]; y++) for (int x = 0; x < w[2]; x++) samples[y * w[2] + x] = map[((w[1] + y) * 224 + w[0] + x) % map.Length];
        return session.Send(samples, w[0], w[1], w[2], w[3]);
    }

    Outcome Of(uint sequence)
    {
        Outcome outcome;
        return outcomes.TryGetValue(sequence, out outcome) ? outcome : null;
    }

    T Until<T>(string what, Func<T> look, int patience) where T : class
    {
        var watch = Stopwatch.StartNew();
        lock (gate)
        {
            while (true)
            {
                var found = look();
                if (twice != null) throw new Missed(twice);
                if (found != null) return found;
                int left = patience - (int)watch.ElapsedMilliseconds;
                if (left <= 0) throw new Missed(what + ": not within " + patience + " ms");
                Monitor.Wait(gate, left);
            }
        }
    }

    static void Steer(string what)
    {
        using (var web = new WebClient()) web.UploadString(Environment.GetEnvironmentVariable("PAPILLA_CONTROL") + "/" + what, "");
    }

    void Burst(JObject step, JObject expect)
    {
        int count = (int)step["count"], gapMs = (int?)step["gap_ms"] ?? 0, before = session.SupersededByClient;
        bool isPaused = (bool?)step["paused"] ?? false;
        var sequences = new uint[count];
        var maps = Enumerable.Range(1, count).Select(k => Pattern((JObject)step["pressure"], (double)k / count)).ToArray();
        if (isPaused) Steer("pause");
        for (int k = 0; k < count; k++)
        {
            sequences[k] = session.Send(maps[k]);
            Thread.Sleep(gapMs);
        }
        if (isPaused) Steer("resume");
        Until("all outcomes", () => sequences.All(outcomes.ContainsKey) ? sequences : null, patienceMs);
        foreach (uint one in sequences)
        {
            if (outcomes[one].Status != Status.Ok && outcomes[one].Status != Status.Superseded) throw new Missed("a frame was " + outcomes[one].Status);
        }
        var rendered = order.Where(one => outcomes[one].Status == Status.Ok).ToArray();
        if (!rendered.SequenceEqual(rendered.OrderBy(one => one))) throw new Missed("answers came out of order");
        Check((JObject)expect["newest"] ?? new JObject(), outcomes[sequences[count - 1]]);
        int superseded = sequences.Count(one => outcomes[one].Status == Status.Superseded);
        if (superseded < ((int?)expect["superseded"] ?? 0)) throw new Missed(superseded + " superseded");
        if (session.SupersededByClient - before < ((int?)expect["superseded_by_client"] ?? 0)) throw new Missed((session.SupersededByClient - before) + " superseded by the client");
    }

    void Reconnect(double withinS)
    {
        lock (gate) reply = null;
        Steer("restart");
        Until("a new session", () => reply as Ready, (int)(1000 * withinS));
    }

    void Told(string words)
    {
        if (!session.Warnings.Any(each => each.Contains(words))) throw new Missed("nobody was told: " + words);
    }

    /// <summary>The server stops, or dies, while frames wait for it.</summary>
    void Silence(JObject step)
    {
        string how = (string)step["how"];
        var map = Pattern((JObject)step["pressure"], 1);
        uint first = session.Send(map), last = 0;
        Until("the frame before", () => Of(first), patienceMs);
        session.TimeoutMs = (int)step["timeout_ms"];
        Steer(how);
        var sequences = new List<uint>();
        for (int k = 0; k < (int)step["count"]; k++)
        {
            sequences.Add(last = session.Send(map));
            Thread.Sleep(50);
        }
        Until("all outcomes", () => sequences.All(outcomes.ContainsKey) ? sequences : null, patienceMs);
        foreach (uint one in sequences)
        {
            var status = outcomes[one].Status;
            if (status != Status.Lost && (status != Status.Superseded || one == last)) throw new Missed("a frame is " + status);
        }
        Told("no answer within");
        lock (gate) reply = null;
        Steer(how == "pause" ? "resume" : "start");
        session.TimeoutMs = patienceMs;
        Until("a new session", () => reply as Ready, (int)(1000 * (double)step["within_s"]));
    }

    void Moved(double withinS)
    {
        // It may have moved between the steps.
        Until("another connection", () => session.Connections > connections ? session : null, (int)(1000 * withinS));
        connections = session.Connections;
    }

    /// <summary>It was asked to move and could not, and says why.</summary>
    void Stayed(string why, double withinS)
    {
        // A warning wakes nobody up.
        for (var watch = System.Diagnostics.Stopwatch.StartNew(); !session.Warnings.Any(words => words.Contains(why)); System.Threading.Thread.Sleep(5))
        {
            if (watch.Elapsed.TotalSeconds > withinS) throw new Missed("it does not say: " + why);
        }
        if (session.Connections != connections) throw new Missed("it has moved");
    }

    void Http(JObject step, JObject expect)
    {
        try
        {
            var map = PapillaHttp.Post(url, Pattern((JObject)step["pressure"], 1), (string)step["tier"]);
            Check(expect, new Outcome { Status = Status.Ok, Map = map });
        }
        catch (PapillaException error)
        {
            Check(expect, new Outcome { Status = Status.Error, Code = error.Problem.Code, Field = error.Problem.Field });
        }
    }

    void Rasterise(JObject step, JObject expect)
    {
        var g = step["vertices"]["gaussian_mm"].Select(v => (double)v).ToArray();
        var values = new float[atlas.VertexCount];
        for (int i = 0; i < values.Length; i++)
        {
            double d2 = 0;
            for (int k = 0; k < 3; k++) d2 += Math.Pow(atlas.SkinMm[3 * i + k] - g[k], 2);
            values[i] = (float)(g[4] * Math.Exp(-d2 / (2 * g[3] * g[3])));
        }
        var map = new float[Wire.MapLength];
        atlas.PressureMap(values, map);
        CheckMap(expect, map);
    }

    void Contacts(JObject step, JObject expect)
    {
        var map = new float[Wire.MapLength];
        foreach (var c in step["contacts"])
        {
            double x = (double)c["at_mm"][0], y = (double)c["at_mm"][1], z = (double)c["at_mm"][2], forceN = (double)c["force_n"];
            if (c["radius_mm"] == null) atlas.AddContact(x, y, z, forceN, map);
            else atlas.AddContact(x, y, z, forceN, (double)c["radius_mm"], map);
        }
        CheckMap(expect, map);
        if (expect["force_n"] != null) Near("force", atlas.ForceN(map), (double)expect["force_n"][0], (double)expect["force_n"][1]);
    }
}
