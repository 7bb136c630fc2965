using System;
using System.Collections.Generic;
using System.Linq;
using Newtonsoft.Json.Linq;
using Papilla;

sealed class Missed : Exception
{
    internal Missed(string message) : base(message) { }
}

/// <summary>What was seen of an answer, copied.</summary>
sealed class Outcome
{
    internal Status Status;
    internal string Code, Field;
    internal float[] Map, Summary, Points, Actuators, Rates, PointRatesHz;
    internal int[] Window;
    internal bool NotTracked, CoarseClock, OutOfRange, NoContact, Unfamiliar, CutOff;
    internal ulong ClientTimeUs;
    internal int TierNumber;
    internal uint TotalUs, QueueUs, InferUs;
    internal bool HasTouch, Unsettled;
    internal Touch Touch;
    internal int Finger;
    internal float[] PressurePa;
    internal ErrorEstimate ErrorEstimate = ErrorEstimate.Unknown;
}

/// <content>What is expected, and the patterns.</content>
sealed partial class Run
{
    /// <summary>Throws where the environment asks for a locale with another decimal point than this program has.</summary>
    internal static void CheckLocale()
    {
        var due = Environment.GetEnvironmentVariable("PAPILLA_DECIMAL");
        var found = System.Globalization.CultureInfo.CurrentCulture.NumberFormat.NumberDecimalSeparator;
        if (due != null && due != found) throw new Missed("the locale's decimal point is " + found);
    }

    /// <summary>Does the steps of a case, and prints its line.</summary>
    internal bool Passes(JToken one)
    {
        int at = 0;
        try
        {
            foreach (JObject step in one["steps"])
            {
                at++;
                Do(step);
            }
            Console.WriteLine("ok " + one["name"]);
            return true;
        }
        catch (Exception error)
        {
            Console.WriteLine("FAIL " + one["name"] + ": step " + at + ": " + (error is Missed ? error.Message : error.ToString().Replace('\n', ' ')));
            return false;
        }
    }

    void Check(JObject expect, Outcome got)
    {
        Same("status (" + got.Code + ")", got.Status.ToString().ToLowerInvariant(), (string)expect["status"] ?? "ok");
        if (expect["code"] != null) Same("code", got.Code, (string)expect["code"]);
        if (expect["field"] != null && got.Field != null) Same("field", got.Field, (string)expect["field"]);
        if (got.Status != Status.Ok) return;
        if (got.InferUs + got.QueueUs > got.TotalUs) throw new Missed(got.InferUs + " + " + got.QueueUs + " us are more than " + got.TotalUs);
        if (expect["flags"] != null)
        {
            var flags = new List<string>();
            if (got.OutOfRange) flags.Add("out_of_range");
            if (got.NoContact) flags.Add("no_contact");
            if (got.Unfamiliar) flags.Add("unfamiliar");
            if (got.CutOff) flags.Add("cut_off");
            if (got.NotTracked) flags.Add("not_tracked");
            if (got.CoarseClock) flags.Add("coarse_clock");
            Same("flags", string.Join(",", flags), string.Join(",", expect["flags"].Select(f => (string)f)));
        }
        if (expect["tier"] != null && got.Window != null) Same("tier", tiers[got.TierNumber], (string)expect["tier"]);
        if (expect["window"] != null) Same("window", string.Join(",", got.Window), string.Join(",", expect["window"]));
        if ((bool?)expect["map"] == false && got.Window[2] * got.Window[3] != 0) throw new Missed("a map came");
        All("summary", expect, got.Summary);
        All("points", expect, got.Points);
        All("point_rates", expect, got.PointRatesHz);
        if ((expect["rates"] != null) != (got.Rates != null)) throw new Missed("rates are " + (got.Rates == null ? "missing" : "too many"));
        if (got.Rates != null) CheckMap((JObject)expect["rates"], got.Rates);
        All("actuators", expect, got.Actuators);
        CheckMap(expect, got.Map);
        CheckErrors(expect, got.ErrorEstimate);
    }

    static void CheckTouch(JObject step, JObject expect, Outcome got)
    {
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
        CheckFelt(step, t);
        if (expect["pressure_sum"] != null) Near("pressure", got.PressurePa.Sum(v => (double)v), (double)expect["pressure_sum"][0], (double)expect["pressure_sum"][1]);
        if (got.NotTracked != expect["flags"].Any(f => (string)f == "not_tracked")) throw new Missed("not tracked is " + got.NotTracked);
        if (got.NoContact != expect["flags"].Any(f => (string)f == "no_contact")) throw new Missed("no contact is " + got.NoContact);
        if (got.OutOfRange || got.Unsettled) throw new Missed("out of range or unsettled");
        CheckErrors(expect, got.ErrorEstimate);
    }

    /// <summary>How wrong the answer says that it may be: what is null is infinite.</summary>
    static void CheckErrors(JObject expect, ErrorEstimate got)
    {
        var due = expect["error_estimate"];
        if (due == null) return;
        var found = new[] { got.SedMedian, got.SedP90, got.ForceMedian, got.ForceP90 };
        for (int k = 0; k < found.Length; k++)
        {
            if (due[k].Type != JTokenType.Null) Near("error_estimate " + k, found[k], (double)due[k][0], (double)due[k][1]);
            else if (!float.IsPositiveInfinity(found[k])) throw new Missed("error_estimate " + k + " is " + found[k] + ", not infinite");
        }
    }

    static void CheckMap(JObject expect, float[] map)
    {
        foreach (var pixel in expect["pixels"] ?? new JArray())
        {
            Near("pixel " + pixel[0] + ", " + pixel[1], map[224 * (int)pixel[0] + (int)pixel[1]], (double)pixel[2], (double)pixel[3]);
        }
        if (expect["sum"] != null) Near("sum", map.Sum(v => (double)v), (double)expect["sum"][0], (double)expect["sum"][1]);
        if (expect["max"] != null) Near("max", map.Max(), (double)expect["max"][0], (double)expect["max"][1]);
    }

    static void All(string what, JObject expect, float[] got)
    {
        if (expect[what] == null) return;
        if (got == null || got.Length != expect[what].Count()) throw new Missed(what + " is missing");
        for (int k = 0; k < got.Length; k++) Near(what + " " + k, got[k], (double)expect[what][k][0], (double)expect[what][k][1]);
    }

    static void Near(string what, double got, double due, double tolerance)
    {
        if (!(Math.Abs(got - due) <= tolerance)) throw new Missed(what + " is " + got + ", not " + due + " +- " + tolerance);
    }

    static void Same(string what, string got, string due)
    {
        if (got != due) throw new Missed(what + " is " + got + ", not " + due);
    }

    static float[] Pattern(JObject pattern, double part)
    {
        var map = new float[Wire.MapLength];
        var gaussians = (pattern["gaussians"] ?? new JArray()).Select(g => g.Select(v => (double)v).ToArray()).ToArray();
        var disc = pattern["disc"] == null ? null : pattern["disc"].Select(v => (double)v).ToArray();
        for (int i = 0; i < map.Length; i++)
        {
            double u = i % 224 + 0.5, v = i / 224 + 0.5, p = 0;
            foreach (var g in gaussians) p += g[3] * Math.Exp(-((u - g[0]) * (u - g[0]) + (v - g[1]) * (v - g[1])) / (2 * g[2] * g[2]));
            if (disc != null && (u - disc[0]) * (u - disc[0]) + (v - disc[1]) * (v - disc[1]) <= disc[2] * disc[2]) p += disc[3];
            map[i] = p < 1 ? 0 : (float)(p * part);
        }
        if (pattern["bad"] != null)
        {
            var value = pattern["bad"][2];
            float bad = value.Type != JTokenType.String ? (float)value : (string)value == "nan" ? float.NaN : float.PositiveInfinity;
            map[224 * (int)pattern["bad"][0] + (int)pattern["bad"][1]] = bad;
        }
        return map;
    }

    /// <summary>Behind depths, how fast the thing at each vertex moves, if the step says so.</summary>
    internal static float[] WithVelocity(JObject step, float[] depthMm)
    {
        if (step["velocity"] == null) return depthMm;
        var velocity = step["velocity"].Select(v => (float)v).ToArray();
        return depthMm.Concat(depthMm.SelectMany(_ => velocity)).ToArray();
    }
}
