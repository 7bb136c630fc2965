using System;
using System.IO;
using System.Linq;
using System.Threading;
using Newtonsoft.Json.Linq;
using Papilla;

/// <summary>
/// The script of devices, clients/conformance/devices.json (the argument), as every client runs it, on a clock of its own. Then a hand of the
/// service at PAPILLA_URL: an amplitude as large as its force, which falls to 0 when answers stop.
/// </summary>
static class DevicesTest
{
    static double nowS, tolerance;

    static int Main(string[] arguments)
    {
        var script = JObject.Parse(File.ReadAllText(arguments[0]));
        tolerance = (double)script["tolerance"];
        int failures = 0;
        foreach (JObject one in script["cases"])
        {
            try
            {
                Case(one);
            }
            catch (Exception error)
            {
                failures++;
                Console.WriteLine("FAILED: " + one["name"] + ": " + error);
            }
        }
        if (failures == 0) OfAService();
        Console.WriteLine(failures == 0 ? "checks: " + (script["cases"].Count() + 1) : failures + " cases failed");
        return failures == 0 ? 0 : 1;
    }

    static void Case(JObject one)
    {
        if ((bool?)one["refused"] == true)
        {
            Throws<ArgumentException>(() => DeviceOf(one["device"]));
            return;
        }
        var device = DeviceOf(one["device"]);
        foreach (JObject step in one["steps"])
        {
            nowS = (double)step["at_s"];
            DeviceCommand command;
            if (step.Property("poll") != null) Compare(device.TryPoll(out command), command, step["poll"]);
            else if (step["stop"] != null) Compare(true, device.Stop(), step["stop"]);
            else if ((bool?)step["refused"] == true) Throws<ArgumentException>(() => device.Feed(AnswerOf(step["feed"])));
            else if ((bool?)step["not_carried"] == true) Throws<NotCarriedException>(() => device.Feed(AnswerOf(step["feed"])));
            else device.Feed(AnswerOf(step["feed"]));
        }
    }

    static double Number(JToken said)
    {
        return said.Type != JTokenType.String ? (double)said : (string)said == "nan" ? double.NaN : double.PositiveInfinity;
    }

    static ReadLevels ReaderOf(JToken said)
    {
        if (said["force"] != null) return Device.Force(Number(said["force"]["full_n"]), (double?)said["force"]["threshold_n"] ?? 0);
        if (said["actuators"] != null) return Device.Actuators((double)said["actuators"]["full"]);
        var units = new JArray(said["spike_rate"]["units"].Select(name => new JObject(new JProperty("class", name))));
        return new SpikeRate(units, (double)said["spike_rate"]["full_hz"]).Read;
    }

    static Device DeviceOf(JToken said)
    {
        return new Device(ReaderOf(said), (int?)said["fingers"] ?? 1, (double?)said["max_hz"] ?? 90, (double?)said["hold_s"] ?? 0.05, (double?)said["fade_s"] ?? 0.05, () => nowS);
    }

    static Answer AnswerOf(JToken said)
    {
        var answer = new Answer
        {
            Status = (Status)Enum.Parse(typeof(Status), (string)said["status"] ?? "ok", true),
            Finger = (int?)said["finger"] ?? 0,
            ClientTimeUs = (ulong?)said["client_time_us"] ?? 0,
            NoContact = (bool?)said["no_contact"] ?? false,
            NotTracked = (bool?)said["not_tracked"] ?? false,
        };
        if (said["force_n"] != null)
        {
            answer.HasTouch = true;
            answer.Touch = new Touch { ForceXN = (float)Number(said["force_n"][0]), ForceYN = (float)Number(said["force_n"][1]), ForceZN = (float)Number(said["force_n"][2]) };
        }
        answer.HasSummary = said["summary_force_n"] != null;
        if (answer.HasSummary) answer.Summary[0] = (float)said["summary_force_n"];
        if (said["actuators"] != null)
        {
            foreach (var value in said["actuators"]) answer.Actuators[answer.ActuatorCount++] = (float)value;
        }
        if (said["spikes"] != null)
        {
            answer.Spikes = said["spikes"].Select(unit => new Spike { Unit = (ushort)unit }).ToArray();
            answer.SpikeCount = answer.Spikes.Length;
        }
        return answer;
    }

    static void Compare(bool isThere, DeviceCommand command, JToken due)
    {
        if (isThere != (due.Type != JTokenType.Null)) throw new Exception(isThere ? "a command of " + command.Amplitude : "no command");
        if (!isThere) return;
        for (int finger = 0; finger < due["levels"].Count(); finger++)
        {
            for (int k = 0; k < due["levels"][finger].Count(); k++)
            {
                Near("level", k < command.Levels[finger].Length ? command.Levels[finger][k] : 0, (double)due["levels"][finger][k]);
            }
        }
        Near("amplitude", command.Amplitude, (double)due["amplitude"]);
        Near("duration", command.DurationS, (double)due["duration_s"]);
    }

    static void Near(string what, double found, double due)
    {
        if (!(Math.Abs(found - due) <= tolerance)) throw new Exception(what + " is " + found + ", not " + due);
    }

    static void Throws<T>(Action act) where T : Exception
    {
        try
        {
            act();
        }
        catch (T)
        {
            return;
        }
        throw new Exception("no " + typeof(T).Name);
    }

    /// <summary>On the real clock: the amplitude follows the force; no answer comes any more, and the last command is one of 0.</summary>
    static void OfAService()
    {
        var hello = new Hello { Objects = { new TouchObject { Shape = new SphereShape { RadiusMm = 10 } } }, Map = false };
        using (var session = new Session(Environment.GetEnvironmentVariable("PAPILLA_URL"), hello).Open())
        {
            session.TimeoutMs = 30000;
            session.WaitReady(30000);
            var device = new Device(Device.Force(1));
            uint sequence = session.SendPoses(new[] { new Pose(11.25f, 0, -15.9f) });
            Answer answer = null;
            for (int tries = 0; tries < 30000 && !(session.TryTakeLatest(out answer) && answer.Sequence == sequence); tries++) Thread.Sleep(1);
            device.Feed(answer);
            DeviceCommand command;
            if (!device.TryPoll(out command)) throw new Exception("no command of an answer");
            float x = answer.Touch.ForceXN, y = answer.Touch.ForceYN, z = answer.Touch.ForceZN, begun = command.Amplitude;
            tolerance = 1e-5;
            Near("amplitude", begun, Math.Min(1, Math.Sqrt(x * x + y * y + z * z)));
            if (!(begun > 0.05)) throw new Exception("a force of " + begun + " N");
            int commands = 0;
            for (int tries = 0; tries < 30000 && command.Amplitude > 0; tries++)
            {
                if (device.TryPoll(out command)) commands++;
                else command.Amplitude = begun;
                Thread.Sleep(1);
            }
            if (command.Amplitude != 0 || device.TryPoll(out command)) throw new Exception("it does not fall silent");
            Console.WriteLine("ok unity: a device of " + begun + " N fell silent after " + commands + " commands");
        }
    }
}
