using System.Collections.Generic;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>What a session asks for; null members take the server's default. See docs/reference/protocol-hello.md.</summary>
    public sealed class Hello
    {
        /// <summary>Tier by name; null: the server's choice.</summary>
        public string Tier;
        /// <summary>Time a frame may spend in the server, us.</summary>
        public uint? BudgetUs;
        public SampleType SampleType = SampleType.F32;
        public SampleType? AnswerSampleType;
        /// <summary>Pa per unit of u16 and u8 samples; 0: each frame has its own.</summary>
        public float PressureScalePa;
        /// <summary>Effects of the tier and of the session, by name.</summary>
        public readonly List<string> Effects = new List<string>();
        /// <summary>
        /// Other members as on the wire: <c>contact_pa</c>, <c>out_of_range</c>, <c>stale_after_us</c>, <c>atlas_hash</c>, <c>map</c>, the
        /// parameters of effects, <c>input</c>, <c>objects</c>, <c>fingers</c>, ...
        /// </summary>
        public readonly JObject Members = new JObject();

        /// <summary>A hello from its members on the wire, without type and version.</summary>
        public static Hello FromJson(JObject json)
        {
            var hello = new Hello();
            foreach (var member in json)
            {
                switch (member.Key)
                {
                    case "tier": hello.Tier = (string)member.Value; break;
                    case "budget_us": hello.BudgetUs = (uint?)member.Value; break;
                    case "sample_type": hello.SampleType = Wire.Parse((string)member.Value); break;
                    case "pressure_scale_pa": hello.PressureScalePa = (float?)member.Value ?? 0; break;
                    case "answer_sample_type": hello.AnswerSampleType = Wire.Parse((string)member.Value); break;
                    case "effects": foreach (var effect in member.Value) hello.Effects.Add((string)effect); break;
                    default: hello.Members[member.Key] = member.Value.DeepClone(); break;
                }
            }
            return hello;
        }

        /// <param name="follows">the session moves to another connection when it is asked to</param>
        /// <param name="resumes">what the service remembers is the next message</param>
        internal string ToText(bool follows, bool resumes = false)
        {
            var json = (JObject)Members.DeepClone();
            json["type"] = "hello";
            json["version"] = Wire.Version;
            json["effects"] = new JArray(Effects);
            json["sample_type"] = SampleType.ToString().ToLowerInvariant();
            if (follows) json["reconnect"] = true;
            if (resumes) json["resume"] = true;
            if (Tier != null) json["tier"] = Tier;
            if (BudgetUs != null) json["budget_us"] = BudgetUs;
            if (PressureScalePa > 0) json["pressure_scale_pa"] = PressureScalePa;
            if (AnswerSampleType != null) json["answer_sample_type"] = AnswerSampleType.ToString().ToLowerInvariant();
            return json.ToString(Newtonsoft.Json.Formatting.None);
        }
    }

    /// <summary>Terms of the session, as the server confirmed them.</summary>
    public sealed class Ready
    {
        public readonly string Tier;
        public readonly int TierNumber;
        public readonly long Session;
        public readonly string AtlasHash;
        public readonly long PredictedLatencyUs;
        /// <summary>Greatest pressure that the tier was trained on, Pa; what becomes of more the hello says (<c>out_of_range</c>).</summary>
        public readonly float PressureMaxPa;
        /// <summary>All members, as on the wire.</summary>
        public readonly JObject Json;
        internal readonly int ErrorEstimateAt = -1, TouchAt = -1, PressureAt = -1, PressureCount, ShearAt = -1, ShearCount, SpikesAt = -1, SpikesBytes, VerticesAt = -1, VerticesBytes, RatesAt = -1, RatesBytes;
        internal readonly int SummaryAt = -1, PointsAt = -1, PointsCount, PointRatesAt = -1, PointRatesCount, ActuatorsAt = -1, ActuatorsCount, MapAt = -1;

        internal Ready(JObject json)
        {
            Json = json;
            Tier = (string)json["tier"];
            TierNumber = (int)json["tier_number"];
            Session = (long)json["session"];
            AtlasHash = (string)json["atlas_hash"];
            PredictedLatencyUs = (long)json["predicted_latency_us"];
            PressureMaxPa = (float)json["pressure_max_pa"];
            foreach (var section in json["sections"])
            {
                int at = (int)section["offset"], bytes = (int)section["bytes"];
                switch ((string)section["name"])
                {
                    case "touch": TouchAt = at; break;
                    case "pressure": PressureAt = at; PressureCount = bytes / 4; break;
                    case "shear": ShearAt = at; ShearCount = bytes / 4; break;
                    case "error_estimate": ErrorEstimateAt = at; break;
                    case "spikes": SpikesAt = at; SpikesBytes = bytes; break;
                    case "vertices": VerticesAt = at; VerticesBytes = bytes; break;
                    case "summary": SummaryAt = at; break;
                    case "rates": RatesAt = at; RatesBytes = bytes; break;
                    case "point_rates": PointRatesAt = at; PointRatesCount = bytes / 4; break;
                    case "points": PointsAt = at; PointsCount = bytes / 4; break;
                    case "actuators": ActuatorsAt = at; ActuatorsCount = bytes / 4; break;
                    case "map": MapAt = at; break;
                }
            }
        }
    }

    /// <summary>A refusal by the server.</summary>
    public sealed class Problem
    {
        public readonly string Code, Message, Field;
        internal readonly uint? Sequence;
        internal readonly bool Closes;

        internal Problem(JObject json)
        {
            Code = (string)json["code"];
            Message = (string)json["message"];
            Field = (string)json["field"];
            Sequence = (uint?)json["sequence"];
            Closes = (bool?)json["closes"] ?? false;
        }

        internal Problem(string code, string message, string field = null)
        {
            Code = code;
            Message = message;
            Field = field;
        }

        public override string ToString()
        {
            return Code + ": " + Message;
        }
    }

    /// <summary>A hello, a map or a request was refused.</summary>
    public sealed class PapillaException : System.Exception
    {
        public readonly Problem Problem;

        public PapillaException(Problem problem) : base(problem.ToString())
        {
            Problem = problem;
        }
    }
}
